"""What a glossy surface shows of a shell's mirrors, in which its LEDs shine: blurred by its lobe.

Each mirror is a light of its mean power on the object, in the direction of its apex. GGX's lobe
about the mirrored ray blurs them, as if it were round, and as wide as at normal incidence; and by
the steps of the map, which are finer than what a pixel shows of a curved surface.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.core.geometry.loop_vectors import Vector, dot, plus_scaled, unit
from tbcad.core.geometry.vectors import norm
from tbcad.core.geometry.vectors import unit as unit_rows
from tbcad.core.optics.mirror_light import REFLECTED, Lamps, light_of_mirrors, lit_mirrors
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.types import Floats

ROWS, COLUMNS = 90, 180  # of the map of directions, 2 degrees each
LEVELS = 8  # of roughness, between which light is interpolated
PLACES, WITHIN = 12, 0.4  # at which a mirror's light is found; as a share of the capture diameter


@dataclass(frozen=True)
class MirrorGlow:
    """Light of mirrors on a glossy surface, as shares of what is shown as white."""

    distance: float  # of the mirrors from the middle of the object, mm
    rough: Floats  # levels of roughness, ascending, (k,)
    light: NDArray[np.float32]  # by roughness, elevation and azimuth of mirrored rays, (k, r, c)
    share: Floats  # of it that the object lets through to its corners, (v, 2)


def mirror_glow(
    export: ExportedDesign, lamps: Lamps, rough: Floats, share: Floats, white: float
) -> MirrorGlow:
    """Of a shell's mirrors by its lamps, for surfaces of some roughness (n,); NaN: matt."""
    low, high = np.nanmin(rough), np.nanmax(rough)
    levels = np.geomspace(low, high, LEVELS) if high > 1.01 * low else np.array([low])
    draw = np.random.default_rng(0).normal(size=(PLACES, 3))
    places = WITHIN * export.capture_mm * unit_rows(draw)
    way, power = [], []
    for one in export.reflectors:
        mirrors = lit_mirrors(one.mirrors, one.side, one.foot)
        power.append(REFLECTED * light_of_mirrors(lamps, mirrors, places).mean(axis=1))
        way.append(one.mirrors.apex)
    apex, lux = np.concatenate(way), np.concatenate(power)
    light = np.array([_blurred(unit_rows(apex), lux / white, alpha) for alpha in levels**2])
    return MirrorGlow(float(norm(apex).mean()), levels, light.astype(np.float32), share)


def _blurred(way: Floats, light: Floats, alpha: float) -> Floats:
    """A map (r, c) of light (m,) from directions (m, 3)."""
    step = np.pi / ROWS / 4  # of normals: half of the angle, and half of the step
    rise = np.pi * ((np.arange(ROWS) + 0.5) / ROWS - 0.5)
    turn = 2 * np.pi * (np.arange(COLUMNS) + 0.5) / COLUMNS
    cosine, sine = np.cos(rise)[:, None], np.sin(rise)[:, None]
    x, y, z = np.broadcast_arrays(cosine * np.cos(turn), cosine * np.sin(turn), sine)
    cell = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return _summed(cell, way, light, alpha**2 + step**2).reshape(ROWS, COLUMNS)


@compiled_loop
def _summed(cell: Floats, way: Floats, light: Floats, alpha2: float) -> Floats:
    """By D / (4 cos) of normals at half of the angle, times pi."""
    total = np.zeros(len(cell))
    for i in range(len(cell)):
        for j in range(len(way)):
            along = cell[i, 0] * way[j, 0] + cell[i, 1] * way[j, 1] + cell[i, 2] * way[j, 2]
            up2 = max((1 + along) / 2, 1e-6)
            total[i] += light[j] * alpha2 / (4 * up2 * (up2 * (alpha2 - 1) + 1) ** 2)
    return total


@compiled_part
def glow(
    place: Vector, mirrored: Vector, rough: float, distance: float, levels: Floats, light: Floats
) -> float:
    """Of `MirrorGlow.light` along a unit ray from a place, where it comes to the mirrors."""
    along = dot(place, mirrored)
    far = np.sqrt(along * along - dot(place, place) + distance * distance) - along
    way = unit(plus_scaled(place, far, mirrored))
    row = (np.arcsin(min(max(way[2], -1.0), 1.0)) / np.pi + 0.5) * ROWS - 0.5
    column = np.arctan2(way[1], way[0]) / (2 * np.pi) * COLUMNS - 0.5
    row = min(max(row, 0.0), ROWS - 1.001)
    level = 0.0
    if len(levels) > 1:
        level = np.log(rough / levels[0]) / np.log(levels[-1] / levels[0]) * (len(levels) - 1)
        level = min(max(level, 0.0), len(levels) - 1.001)
    r, c, k = int(row), int(np.floor(column)), int(level)
    total = 0.0
    for a in range(2):
        for b in range(2):
            part = abs(1 - a - (row - r)) * abs(1 - b - (column - c))
            at = (c + b) % COLUMNS
            here = float(light[k, r + a, at])
            if len(levels) > 1:
                here += (level - k) * (light[k + 1, r + a, at] - here)
            total += part * here
    return total
