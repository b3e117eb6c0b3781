"""Warped and wavy builds by slow and independent means: displaced material, brute force."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.reflection import miss_distances
from tbcad.tolerancing.montecarlo.draws import ShellDraws
from tbcad.tolerancing.montecarlo.warp import SmoothField

Heights: TypeAlias = Callable[[int, np.ndarray], np.ndarray]
"""Waviness of a mirror, by its number, at points (p, 3), mm."""

STEP = 1e-4  # mm, of differences
ALONG = 65  # points of an arc
CLOSER = (9, 9, 9, 9)  # points about its minimum, each time between the neighbours of the last


def displaced_coverage(array: MirrorArray, field: SmoothField, numbers: np.ndarray) -> np.ndarray:
    """Coverage of each mirror of a shell whose every point is displaced by a field, mm, (m,).

    Every point of the designed edges goes where the field takes it, and the normal there is that
    of the displaced surface: no sphere is fitted. The seam limits no mirror that it halves. The
    minimum of each edge is sampled ever more closely: without errors of the build the result is
    the designed coverage within 2e-5 mm.
    """
    mirror, arc = _counted_sides(array)
    low, high = np.zeros(len(arc)), np.ones(len(arc))
    for samples in (ALONG, *CLOSER):
        t = np.linspace(low, high, samples, axis=1)
        miss = _displaced_misses(array, field, numbers, mirror, arc, t)
        least, step = t[np.arange(len(t)), miss.argmin(axis=1)], (high - low) / (samples - 1)
        low, high = np.maximum(low, least - step), np.minimum(high, least + step)
    result = np.full(array.cells.mirrors, np.inf)
    np.minimum.at(result, mirror, 2 * miss.min(axis=1))
    return result


def _counted_sides(array: MirrorArray) -> tuple[np.ndarray, np.ndarray]:
    """Mirror and arc of each side that limits a mirror's coverage, two of (e,)."""
    cells = array.cells
    offsets, sides = cells.rings
    mirror = np.repeat(np.arange(cells.mirrors), np.diff(offsets))
    on_seam = (cells.arcs.faces[sides // 2] == cells.seam).any(axis=1)
    counted = ~(on_seam & cells.halved[mirror])
    return mirror[counted], sides[counted] // 2


def _displaced_misses(
    array: MirrorArray,
    field: SmoothField,
    numbers: np.ndarray,
    mirror: np.ndarray,
    arc: np.ndarray,
    t: np.ndarray,
) -> np.ndarray:
    """Distance of the reflected rays from the object's centre at parameters (e, p) of arcs."""
    point = array.cells.arcs.at(np.broadcast_to(arc[:, None], t.shape), t)
    surfaces = array.cells.surfaces
    normal = surfaces.gradient(np.broadcast_to(mirror[:, None], t.shape), point)

    def displaced(x: np.ndarray) -> np.ndarray:
        moved = field.basis(x.reshape(-1, 3)) @ numbers
        return x + moved.reshape(x.shape)

    columns = [(displaced(point + STEP * e) - displaced(point - STEP * e)) for e in np.eye(3)]
    jacobian = np.stack(columns, axis=-1) / (2 * STEP)
    turned = np.linalg.solve(np.swapaxes(jacobian, -1, -2), normal[..., None])[..., 0]
    turned /= np.linalg.norm(turned, axis=-1)[..., None]
    return miss_distances(array.camera.pinhole, displaced(point), turned)


def wavy_coverage(
    array: MirrorArray,
    draws: ShellDraws,
    k: int,
    mirror: int,
    heights: Heights,
    ways: int = 720,
) -> float:
    """Coverage of a wavy mirror of build k by bisection of where each way from its apex ends, mm.

    Every surface is the place where the value of its sphere equals the height of its waviness;
    neither circles nor corners are used, and nothing is linear.
    """
    every, m = array.cells.surfaces, len(array)
    apart = np.linalg.norm(array.mirrors.apex - array.mirrors.apex[mirror], axis=1)
    others = np.argsort(apart)[1:16]
    normal = every.normal[mirror]
    radius = array.mirrors.radius + draws.radius[k]
    centre = array.mirrors.centre + draws.centre[k]
    first = np.linalg.svd(normal[None])[2][1]
    turn = np.linspace(0, 2 * np.pi, ways, endpoint=False)[:, None]
    way = np.cos(turn) * first + np.sin(turn) * np.cross(normal, first)

    def value(which: int, x: np.ndarray) -> np.ndarray:
        away = x - centre[which]
        sphere = (np.sum(away * away, axis=1) - radius[which] ** 2) / (2 * radius[which])
        return np.asarray(sphere - heights(which, x))

    def surface(angle: np.ndarray) -> np.ndarray:
        out = np.cos(angle)[:, None] * normal + np.sin(angle)[:, None] * way
        x = centre[mirror] + radius[mirror] * out
        for _ in range(4):
            x = x - value(mirror, x)[:, None] * out
        return x

    def inside(x: np.ndarray) -> np.ndarray:
        clear = np.all([value(other, x) >= 0 for other in others], axis=0)
        for wall in (m, m + 1):
            clear &= (x - every.apex[wall]) @ every.normal[wall] >= 0
        return np.asarray(clear)

    low, high = np.zeros(ways), np.full(ways, 30 / radius[mirror])
    np.minimum(high, np.pi / 2, out=high)
    assert inside(surface(low)).all()
    for _ in range(34):
        middle = (low + high) / 2
        kept = inside(surface(middle))
        low, high = np.where(kept, middle, low), np.where(kept, high, middle)
    point = surface(low)
    gradient = np.stack(
        [value(mirror, point + STEP * e) - value(mirror, point - STEP * e) for e in np.eye(3)],
        axis=1,
    )
    gradient /= np.linalg.norm(gradient, axis=1)[:, None]
    return float(2 * miss_distances(array.camera.pinhole, point, gradient).min())
