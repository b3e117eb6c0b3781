"""Exact rays from camera over mirror past the object, and what each mirror sees."""

import numpy as np
from numpy.typing import NDArray

from tbcad.optics.cells import Cells
from tbcad.optics.vectors import dot, norm, unit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SAMPLES = 9
REFINEMENTS = 3


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


def counted_sides(cells: Cells) -> tuple[Ints, Ints]:
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


def coverage(cells: Cells, pinhole: Floats) -> Floats:
    """Coverage diameter of each mirror, mm, (m,).

    Twice the least distance from the origin of all rays camera -> edge of the cell -> reflected
    (DESIGN.md section 2), by samples along each arc, refined about the least.
    """
    mirror, arc = counted_sides(cells)
    low, high = np.zeros(len(arc)), np.ones(len(arc))
    for _ in range(REFINEMENTS):
        t = np.linspace(low, high, SAMPLES, axis=1)
        distance = _along(cells, pinhole, mirror, arc, t)
        best = np.argmin(distance, axis=1)[:, None]
        low = np.take_along_axis(t, np.maximum(best - 1, 0), axis=1)[:, 0]
        high = np.take_along_axis(t, np.minimum(best + 1, SAMPLES - 1), axis=1)[:, 0]
    least = np.full(cells.mirrors, np.inf)
    np.minimum.at(least, mirror, distance.min(axis=1))
    return 2 * least


def _along(cells: Cells, pinhole: Floats, mirror: Ints, arc: Ints, t: Floats) -> Floats:
    arcs = np.broadcast_to(arc[:, None], t.shape)
    point = cells.arcs.at(arcs, t)
    normal = cells.surfaces.gradient(np.broadcast_to(mirror[:, None], t.shape), point)
    return miss_distances(pinhole, point, normal)
