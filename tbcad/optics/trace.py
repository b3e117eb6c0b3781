"""Exact rays from camera over mirror past the object, and what each mirror sees."""

import numpy as np

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.cells import Cells
from tbcad.types import Floats, Ints

# Samples of each arc, first over all of it, then about the least; a parabola does the rest.
SAMPLES = 9
ROUNDS = 3


def reflected(pinhole: Floats, point: Floats, normal: Floats) -> Floats:
    """Unit directions (..., 3) of rays from the pinhole after the mirror at points (..., 3)."""
    ray = unit(point - pinhole)
    result: Floats = ray - 2 * dot(ray, normal)[..., None] * normal
    return result


def miss_distances(pinhole: Floats, point: Floats, normal: Floats) -> Floats:
    """Distances (...) of the reflected rays from the origin, mm."""
    out = reflected(pinhole, point, normal)
    result: Floats = norm(np.cross(point, out))
    return result


def limiting_sides(cells: Cells) -> tuple[Ints, Ints]:
    """Mirror and arc of each side that limits what a mirror sees.

    The seam halves a mirror whose apex lies on it; its other half belongs to the other camera
    and shares its virtual camera, so the cut itself does not limit the two together.
    """
    faces = cells.arcs.faces
    arc, which = np.nonzero(faces < cells.mirrors)
    mirror, other = faces[arc, which], faces[arc, 1 - which]
    halved = cells.surfaces.apex[mirror, 0] == 0
    counted = ~(halved & (other == cells.boundary.seam))
    return mirror[counted], arc[counted]


def coverage_diameters(cells: Cells, pinhole: Floats) -> Floats:
    """Coverage diameter of each mirror, mm, (m,).

    Twice the least distance from the origin of all rays camera -> edge of the cell -> reflected
    (DESIGN.md section 2), by samples along each arc, refined about the least.
    """
    mirror, arc = limiting_sides(cells)
    low, high = np.zeros(len(arc)), np.ones(len(arc))
    row = np.arange(len(arc))
    for _ in range(ROUNDS):
        t = np.linspace(low, high, SAMPLES, axis=1)
        distance = _along(cells, pinhole, mirror, arc, t)
        best = np.argmin(distance, axis=1)
        low, high = t[row, np.maximum(best - 1, 0)], t[row, np.minimum(best + 1, SAMPLES - 1)]
    least = np.full(cells.mirrors, np.inf)
    np.minimum.at(least, mirror, _lowest(distance))
    return 2 * least


def _lowest(values: Floats) -> Floats:
    """Least of each row (k, s) of even samples, on the parabola through its neighbours."""
    row, best = np.arange(len(values)), np.argmin(values, axis=1)
    middle = np.clip(best, 1, values.shape[1] - 2)
    before, here, after = (values[row, middle + k] for k in (-1, 0, 1))
    bend, slope = before - 2 * here + after, after - before
    inside = (best == middle) & (bend > 0)
    result: Floats = values[row, best]
    result[inside] -= (slope**2)[inside] / (8 * bend)[inside]
    return result


def _along(cells: Cells, pinhole: Floats, mirror: Ints, arc: Ints, t: Floats) -> Floats:
    arcs = np.broadcast_to(arc[:, None], t.shape)
    point = cells.arcs.at(arcs, t)
    normal = cells.surfaces.gradient(np.broadcast_to(mirror[:, None], t.shape), point)
    return miss_distances(pinhole, point, normal)
