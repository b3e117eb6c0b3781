"""Builds by slow and independent means: cells of known topology, brute force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics import windows
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.optics.reflection import miss_distances, reflected_rays
from tbcad.core.optics.surfaces import Surfaces
from tbcad.tolerancing.montecarlo.draws import (
    ShellDraws,
    SmoothField,
    draw,
    draw_kinds,
    pivots,
    shell_error_shapes,
    smooth_field,
)
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, warp_maps_of
from tbcad.tolerancing.montecarlo.error_kinds import Errors

FINE = 5  # rounds of refinement with which the slow tracing is good to 1e-8 mm
Heights: TypeAlias = Callable[[int, np.ndarray], np.ndarray]
"""Waviness of a mirror, by its number, at points (p, 3), mm."""
STEP = 1e-4  # mm, of differences
ALONG = 65  # points of an arc
CLOSER = (9, 9, 9, 9)  # points about its minimum, each time between the neighbours of the last


def made(array: MirrorArray, draws: ShellDraws, k: int) -> Cells:
    """Cells of build k before its shell is scaled and moved."""
    every, m = array.cells.surfaces, len(array)
    radius = 1 / every.curvature[:m] + draws.radius[k]
    centre = array.mirrors.centre + draws.centre[k]
    spheres = Surfaces(centre + radius[:, None] * every.normal[:m], every.normal[:m], 1 / radius)
    walls = every.subset(slice(m, m + PLANES))
    if isinstance(array.cells, PedestalCells):
        return array.cells.with_mirrors(spheres)
    return cells_of(spheres.joined(walls), array.cells.triangles)


def placed(cells: Cells, scale: float, middle: np.ndarray) -> Cells:
    """Cells scaled evenly, seen from an object's middle."""
    at = cells.surfaces
    surfaces = Surfaces(at.apex * scale - middle, at.normal, at.curvature / scale)
    moved = replace(cells, surfaces=surfaces, corners=cells.corners * scale - middle)
    if isinstance(moved, PedestalCells):
        points = moved.edges.points * scale - middle
        return replace(moved, edges=replace(moved.edges, points=points))
    return moved


def traced_coverage(array: MirrorArray, draws: ShellDraws, k: int) -> np.ndarray:
    """Coverage of each mirror of build k by tbcad.core.optics.windows, mm; of even scale only."""
    scale = draws.scale[k, 0]
    assert np.all(draws.scale[k] == scale)
    back = Rotation.from_rotvec(draws.shell_tilt[k]).inv()
    pinhole = back.apply(array.camera.pinhole + draws.camera_shift[k] - draws.shell_shift[k])
    middle = back.apply(-draws.shell_shift[k])
    cells = made(array, draws, k)
    whole = array.cells.surfaces.apex[:, 0] != 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(windows, "ROUNDS", FINE)
        patch.setattr(windows, "limiting_sides", lambda one: _counted(one, whole))
        return windows.coverage_diameters(placed(cells, scale, middle), pinhole - middle)


def _counted(cells: Cells, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What core.optics.windows.limiting_sides does, with the halved mirrors known beforehand."""
    faces = cells.arcs.faces
    arc, which = np.nonzero(faces < cells.mirrors)
    mirror, other = faces[arc, which], faces[arc, 1 - which]
    counted = whole[mirror] | (other != cells.seam)
    return mirror[counted], arc[counted]


def surrounded(array: MirrorArray, shift: np.ndarray) -> np.ndarray:
    """Whether each whole mirror's rays go round the object's middle, the camera moved, (m,).

    By the angle that the outline's image turns about the middle, along finely sampled arcs.
    """
    cells, pinhole = array.cells, array.camera.pinhole + shift
    offsets, sides = cells.rings
    mirror = np.repeat(np.arange(cells.mirrors), np.diff(offsets))
    t = np.broadcast_to(np.linspace(0, 1, 65), (len(sides), 65))
    t = np.where((sides % 2 == 1)[:, None], 1 - t, t)
    point = cells.arcs.at(np.broadcast_to((sides // 2)[:, None], t.shape), t)
    face = np.broadcast_to(mirror[:, None], t.shape)
    out = reflected_rays(pinhole, point, cells.surfaces.gradient(face, point))
    u = array.u[mirror][:, None]
    image = point - out * ((point * u).sum(axis=2) / (out * u).sum(axis=2))[..., None]
    first = np.cross(array.u, [0.3, 0.5, 0.8])
    second = np.cross(array.u, first)
    angle = np.arctan2(
        np.einsum("stx,sx->st", image, second[mirror]),
        np.einsum("stx,sx->st", image, first[mirror]),
    )
    turned = np.diff(np.unwrap(angle, axis=1)[:, [0, -1]], axis=1)[:, 0]
    return np.abs(np.bincount(mirror, turned)) > np.pi


def drawn(halves: EdgeModels, errors: Errors, builds: range) -> tuple[ShellDraws, ShellDraws]:
    maps, half = warp_maps_of(halves, errors), halves[0]
    return draw(errors, 7, builds, len(half), maps, len(half.walls))


def warp_fields(
    halves: EdgeModels, errors: Errors, builds: range
) -> tuple[list[SmoothField], np.ndarray]:
    """Of both halves the fields of `drawn`, and their random numbers (s, 2, K, 3)."""
    chosen = pivots(halves[0].apex, errors.warp.length)
    fields = [smooth_field(half.apex, errors.warp.length, chosen) for half in halves]
    shapes = shell_error_shapes(len(halves[0]), len(chosen))
    return fields, draw_kinds(errors, 7, builds, shapes)["warp"]


def displaced_coverage(array: MirrorArray, field: SmoothField, numbers: np.ndarray) -> np.ndarray:
    """Coverage of each mirror of a shell whose every point is displaced by a field, mm, (m,).

    Every point of the designed edges goes where the field takes it, and the normal there is that
    of the displaced surface: no sphere is fitted. The seam limits no mirror that it halves. The
    minimum of each edge is sampled ever more closely: without errors of the build the result is
    the designed coverage within 2e-5 mm.
    """
    mirror, arc = _counted(array.cells, ~array.cells.halved)
    low, high = np.zeros(len(arc)), np.ones(len(arc))
    for samples in (ALONG, *CLOSER):
        t = np.linspace(low, high, samples, axis=1)
        miss = _displaced_misses(array, field, numbers, mirror, arc, t)
        least, step = t[np.arange(len(t)), miss.argmin(axis=1)], (high - low) / (samples - 1)
        low, high = np.maximum(low, least - step), np.minimum(high, least + step)
    result = np.full(array.cells.mirrors, np.inf)
    np.minimum.at(result, mirror, 2 * miss.min(axis=1))
    return result


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


def last_inside(
    normal: np.ndarray, widest: float, inside: Callable[[np.ndarray], np.ndarray], ways: int
) -> np.ndarray:
    """Directions (w, 3) all around a normal, as far from it as they are inside, by bisection."""
    first = np.linalg.svd(normal[None])[2][1]
    turn = np.linspace(0, 2 * np.pi, ways, endpoint=False)[:, None]
    way = np.cos(turn) * first + np.sin(turn) * np.cross(normal, first)

    def outward(angle: np.ndarray) -> np.ndarray:
        return np.asarray(np.cos(angle)[:, None] * normal + np.sin(angle)[:, None] * way)

    low, high = np.zeros(ways), np.full(ways, min(widest, np.pi / 2))
    assert inside(outward(low)).all()
    assert not inside(outward(high)).any()
    for _ in range(40):
        middle = (low + high) / 2
        kept = inside(outward(middle))
        low, high = np.where(kept, middle, low), np.where(kept, high, middle)
    return outward(low)


def bisected_coverage(
    array: MirrorArray,
    draws: ShellDraws,
    k: int,
    mirror: int,
    heights: Heights = lambda _, x: np.zeros(len(x)),
    ways: int = 4_000,
) -> float:
    """Coverage of a mirror of build k by bisection of where each way from its apex ends, mm.

    Every surface is the place where the value of its sphere equals the height of its waviness,
    scaled as it is; neither circles nor corners are used, and nothing is linear.
    """
    every, m, scale = array.cells.surfaces, len(array), draws.scale[k]
    apart = np.linalg.norm(array.mirrors.apex - array.mirrors.apex[mirror], axis=1)
    others = np.argsort(apart)[1:26]
    radius = array.mirrors.radius + draws.radius[k]
    centre = array.mirrors.centre + draws.centre[k]

    def value(which: int, x: np.ndarray) -> np.ndarray:
        away = x - centre[which]
        sphere = (np.sum(away * away, axis=1) - radius[which] ** 2) / (2 * radius[which])
        return np.asarray(sphere - heights(which, x))

    def surface(out: np.ndarray) -> np.ndarray:
        x = centre[mirror] + radius[mirror] * out
        for _ in range(4):
            x = x - value(mirror, x)[:, None] * out
        return np.asarray(x)

    def inside(out: np.ndarray) -> np.ndarray:
        x = surface(out)
        clear = np.all([value(other, x) >= 0 for other in others], axis=0)
        for wall in (m, m + 1):
            clear &= (x - every.apex[wall]) @ every.normal[wall] >= 0
        return np.asarray(clear)

    x = surface(last_inside(every.normal[mirror], 60 / radius[mirror], inside, ways))
    steps = STEP * np.eye(3)
    gradient = np.stack([value(mirror, x + e) - value(mirror, x - e) for e in steps], axis=1)
    gradient /= scale
    gradient /= np.linalg.norm(gradient, axis=1)[:, None]
    return float(2 * miss_distances(array.camera.pinhole, scale * x, gradient).min())
