"""Orientations to try: on the faces of the convex hull, along the file's axes, or tilted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from tbcad_verify.mesh.vectors import norm, tangent_basis
from tbcad_verify.printing.rotating_callipers import Silhouette, silhouette
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats

MAX_FACES = 24  # of the hull that are tried, the largest first
MIN_SHARE = 0.002  # of the hull's area, for a face to rest on
GRID = 1 / 256  # side of the cells of directions whose facets are merged
SAME_COS = np.cos(np.radians(0.1))  # directions closer than this are one
AXES = np.vstack([-np.eye(3)[::-1], np.eye(3)[::-1]]).T  # -z first: as the file has it


@dataclass(frozen=True)
class HullView:
    """A hull with one of its directions down, whatever the machine."""

    level: Floats  # (3, 3) rotation from the file's axes to some with z up
    seen: Silhouette  # from above
    height: float  # mm


@dataclass(frozen=True)
class PartHull:
    """The convex hull of a part."""

    points: Floats  # (3, V) its corners, mm
    down: Floats  # (3, D) unit directions which can point down: large faces, then the axes
    tilted: Floats  # (3, T) others, tried when nothing else fits

    @cached_property
    def standing(self) -> list[HullView]:
        """The hull seen along each of `down`."""
        return [_view(self.points, down) for down in self.down.T]

    @cached_property
    def leaning(self) -> list[HullView]:
        """The hull seen along each of `tilted`."""
        return [_view(self.points, down) for down in self.tilted.T]


def _view(points: Floats, down: Floats) -> HullView:
    level = np.stack([*(side[:, 0] for side in tangent_basis(-down[:, None])), -down])
    turned = np.einsum("ij,jn->in", level, points)
    return HullView(level, silhouette(turned[:2]), float(np.ptp(turned[2])))


def part_hull(points: Floats) -> PartHull:
    """The hull of points (V, 3), and the directions to try.

    Raises:
        Unknown: all points lie in a plane.
    """
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise Unknown("the part is flat: its points lie in one plane") from error
    faces = _faces(hull, points)
    down = _distinct(np.hstack([faces, AXES]))
    return PartHull(points[hull.vertices].T, down, _tilted(down[:, 0]))


def _faces(hull: ConvexHull, points: Floats) -> Floats:
    """(3, D) outward normals of the largest faces; parallel triangles count as one."""
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    normal = hull.equations[:, :3].T
    order = np.argsort(-area, kind="stable")  # so that each cell's first is its largest
    cell = np.rint(normal[:, order] / GRID).astype(np.int64)
    _, first, group = np.unique(cell, axis=1, return_index=True, return_inverse=True)
    size = np.bincount(group.ravel(), area[order])
    best = np.lexsort((first, -size))[:MAX_FACES]
    best = best[size[best] > MIN_SHARE * area.sum()]
    return np.asarray(normal[:, order[first[best]]])


def _distinct(directions: Floats) -> Floats:
    distinct: list[Floats] = []
    for d in directions.T:
        if all(float((d * other).sum()) < SAME_COS for other in distinct):
            distinct.append(d)
    return np.array(distinct).T


def _tilted(down: Floats) -> Floats:
    """(3, 20) along the diagonals of a box that stands on the largest face."""
    one, two = (side[:, 0] for side in tangent_basis(down[:, None]))
    steps = [s for s in product((-1, 0, 1), repeat=3) if np.abs(s).sum() > 1]
    frame = np.stack([one, two, down], axis=1)
    tilted = np.einsum("ij,kj->ik", frame, np.array(steps, dtype=np.float64))
    return np.asarray(tilted / norm(tilted))
