"""What a glossy surface shows of a shell's mirrors, in which its LEDs shine: blurred by its lobe.

Each mirror is a light of its mean power on the object, in the direction of its apex. They are
blurred by GGX's lobe of a surface seen from ahead, about a direction between mirrored ray and
normal, and by the steps of the map, which are finer than what a pixel shows of a curved surface.
That is multiplied by what the surface reflects of an even sky. Source: B. Karis, Real Shading in
Unreal Engine 4, SIGGRAPH 2013 (split sum); S. Lagarde and C. de Rousiers, Moving Frostbite to
Physically Based Rendering, SIGGRAPH 2014, section 4.9.3 (direction).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.core.geometry.loop_vectors import Vector, dot, plus_scaled, reflect, scaled, unit
from tbcad.core.geometry.vectors import norm
from tbcad.core.geometry.vectors import unit as unit_rows
from tbcad.core.optics.mirror_light import REFLECTED, Lamps, light_of_mirrors, lit_mirrors
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.types import Floats

ROWS, COLUMNS = 90, 180  # of the map of directions, 2 degrees each
LEVELS = 8  # of roughness, between which light is interpolated
SIGHTS = 32  # cosines of rays from the surface
PLACES, WITHIN = 12, 0.4  # at which a mirror's light is found; as a share of the capture diameter


@dataclass(frozen=True)
class MirrorGlow:
    """Light of mirrors on a glossy surface, as shares of what is shown as white."""

    distance: float  # of the mirrors from the middle of the object, mm
    rough: Floats  # levels of roughness, ascending, (k,)
    light: NDArray[np.float32]  # by roughness, elevation and azimuth of mirrored rays, (k, r, c)
    # of an even sky, parts of F0 and 1 - F0, by roughness and cosine of the ray, (k, s, 2)
    even: Floats
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
    even = np.array([_even_sky(alpha) for alpha in levels**2])
    light /= even[:, -1, :1, None]
    return MirrorGlow(float(norm(apex).mean()), levels, light.astype(np.float32), even, share)


def _even_sky(alpha: float) -> Floats:
    """What a surface reflects of it, (s, 2), by the slopes of 1,024 of its normals."""
    u, turn = ((np.arange(32) + 0.5) / 32 * size for size in (1, 2 * np.pi))
    slope = alpha * np.sqrt(u / (1 - u))[:, None]
    half = np.stack(np.broadcast_arrays(slope * np.cos(turn), slope * np.sin(turn), 1.0), axis=-1)
    half = unit_rows(half.reshape(-1, 3))
    result = []
    for sees in (np.arange(SIGHTS) + 0.5) / SIGHTS:
        along = half @ np.array([np.sqrt(1 - sees**2), 0, sees])
        falls = 2 * along * half[:, 2] - sees
        lit = (along > 0) & (falls > 0)
        g2 = 1.0
        for cosine in (falls[lit], sees):
            g2 = g2 * 2 * cosine / (cosine + np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2))
        part = g2 * along[lit] / (sees * half[lit, 2])
        result.append([part.sum(), (part * (1 - along[lit]) ** 5).sum()])
    return np.array(result) / len(half)


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
    """As a surface shows it from ahead: pi D G2 / (4 cos), of normals at half of the angle."""
    total = np.zeros(len(cell))
    for i in range(len(cell)):
        for j in range(len(way)):
            falls = cell[i, 0] * way[j, 0] + cell[i, 1] * way[j, 1] + cell[i, 2] * way[j, 2]
            if falls > 0:
                spread = alpha2 / ((1 + falls) / 2 * (alpha2 - 1) + 1) ** 2
                smith = 0.5 / (falls + np.sqrt(falls * falls * (1 - alpha2) + alpha2))
                total[i] += light[j] * falls * spread * smith
    return total


@compiled_part
def glow(
    place: Vector,
    axes: tuple[Vector, Vector],
    rough: float,
    map_of: tuple[float, Floats, NDArray[np.float32], Floats],
) -> tuple[float, float]:
    """What is to be multiplied by F0, and by 1 - F0, of a place with a normal, and a ray to it.

    `map_of`: distance, roughness, light and even sky of `MirrorGlow`.
    """
    (normal, back), (distance, levels, light, even) = axes, map_of
    alpha = rough * rough
    lean = (1 - alpha) * (np.sqrt(1 - alpha) + alpha)
    mirrored = unit(plus_scaled(scaled(lean, reflect(back, normal)), 1 - lean, normal))
    along = dot(place, mirrored)
    far = np.sqrt(along * along - dot(place, place) + distance * distance) - along
    way = unit(plus_scaled(place, far, mirrored))
    row = (np.arcsin(min(max(way[2], -1.0), 1.0)) / np.pi + 0.5) * ROWS - 0.5
    column = np.arctan2(way[1], way[0]) / (2 * np.pi) * COLUMNS - 0.5
    row = min(max(row, 0.0), ROWS - 1.001)
    sight = min(max(-dot(back, normal) * SIGHTS - 0.5, 0.0), SIGHTS - 1.001)
    level = 0.0
    if len(levels) > 1:
        level = np.log(rough / levels[0]) / np.log(levels[-1] / levels[0]) * (len(levels) - 1)
        level = min(max(level, 0.0), len(levels) - 1.0)
    r, c, s = int(row), int(np.floor(column)), int(sight)
    shown, sky, rise = 0.0, 0.0, 0.0
    for k in range(int(level), min(int(level) + 2, len(levels))):
        near = 1 - abs(level - k)
        for a in range(2):
            seen = near * abs(1 - a - (sight - s))
            sky += seen * even[k, s + a, 0]
            rise += seen * even[k, s + a, 1]
            for b in range(2):
                part = near * abs(1 - a - (row - r)) * abs(1 - b - (column - c))
                shown += part * light[k, r + a, (c + b) % COLUMNS]
    return shown * sky, shown * rise
