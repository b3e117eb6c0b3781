"""Orientations to try: on the faces of the convex hull, along the file's axes, or tilted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from tbcad_verify.mesh.vectors import norm, tangent_basis
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats

MAX_FACES = 24  # of the hull that are tried, the largest first
MIN_SHARE = 0.002  # of the hull's area, for a face to rest on
GRID = 1 / 256  # side of the cells of directions whose facets are merged
SAME_COS = np.cos(np.radians(0.1))  # directions closer than this are one
AXES = np.vstack([-np.eye(3)[::-1], np.eye(3)[::-1]]).T  # -z first: as the file has it


@dataclass(frozen=True)
class HullView:
    """A hull with one of its directions down, seen from above, whatever the machine."""

    level: Floats  # (3, 3) rotation from the file's axes to some with z up
    height: float  # mm
    rim: Floats  # (2, N) corners of its outline, mm
    # (K,) rotations that bring an edge of the rim to lie along x or y, rad, ascending
    turns: Floats
    sides: Floats  # (2, K) extents along x and y after each, mm


@dataclass(frozen=True)
class PartHull:
    """The convex hull of a part."""

    points: Floats  # (3, V) its corners, mm
    down: Floats  # (3, D) unit directions which can point down: large faces, then the axes
    tilted: Floats  # (3, T) others, tried when nothing else fits

    @cached_property
    def standing(self) -> list[HullView]:
        """The hull seen along each of `down`."""
        return [hull_view(self.points, down) for down in self.down.T]

    @cached_property
    def leaning(self) -> list[HullView]:
        """The hull seen along each of `tilted`."""
        return [hull_view(self.points, down) for down in self.tilted.T]


def hull_view(points: Floats, down: Floats) -> HullView:
    """The view of points (3, N), mm, against a unit direction (3,)."""
    level = np.stack([*(side[:, 0] for side in tangent_basis(-down[:, None])), -down])
    turned = np.einsum("ij,jn->in", level, points)
    rim = turned[:2, ConvexHull(turned[:2].T).vertices]
    edge = np.roll(rim, -1, axis=1) - rim
    across = np.mod(-np.arctan2(edge[1], edge[0]), np.pi / 2)
    turns = _canonical(np.concatenate([across, across + np.pi / 2]))
    return HullView(level, float(np.ptp(turned[2])), rim, turns, _sides(rim, turns))


def part_hull(points: Floats) -> PartHull:
    """The hull of points (V, 3), and the directions to try. Unknown: all points lie in a plane."""
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


def best_rotation(seen: HullView, width: float, depth: float, slack: float) -> tuple[float, Floats]:
    """The best rotation, and the sides of the box after it.

    The smallest of the enclosing rectangles that fit; if none of those with a side along an edge
    fits, the rotation with the smallest excess over width or depth, whichever is larger.

    `width`: of the rectangle along x, mm.
    `depth`: along y, mm.
    `slack`: by how much the sides may be exceeded, mm.

    Returns:
        Angle from 0 to below pi, counter-clockwise, and (2,) extent along x and y, mm.

    Source: H. Freeman, R. Shapira, Determining the Minimum-Area Encasing Rectangle, 1975.
    """
    fits = (seen.sides <= np.array([[width], [depth]]) + slack).all(axis=0)
    if fits.any():
        area = np.where(fits, seen.sides[0] * seen.sides[1], np.inf)
        k = int(np.argmax(area <= area.min() * (1 + 1e-9)))
        return float(seen.turns[k]), seen.sides[:, k]
    balanced = _balanced(seen.rim, seen.turns, width - depth)
    angles = _canonical(np.concatenate([seen.turns, balanced]))
    sides = _sides(seen.rim, angles)
    excess = np.maximum(sides[0] - width, sides[1] - depth)
    k = int(np.argmax(excess <= excess.min() + 1e-9 * np.abs(sides).max()))
    return float(angles[k]), sides[:, k]


def _canonical(turns: Floats) -> Floats:
    """Each rotation once, from 0 to below pi; rounding errors below pi become 0."""
    turns = np.mod(turns, np.pi)
    return np.unique(np.where(turns > np.pi - 1e-9, 0, turns))


def _sides(rim: Floats, turns: Floats) -> Floats:
    """(2, K) extents along x and y of the rim, rotated by each of (K,) angles."""
    cos, sin = np.cos(turns)[:, None], np.sin(turns)[:, None]
    x, y = cos * rim[0] - sin * rim[1], sin * rim[0] + cos * rim[1]
    return np.stack([np.ptp(x, axis=1), np.ptp(y, axis=1)])


def _balanced(rim: Floats, edges: Floats, difference: float) -> Floats:
    """Rotations at which the extents along x and y differ by this: other minima of the excess.

    Between two rotations at which an edge lies along an axis, the outermost points stay the same.
    Both extents are concave sines there: the larger excess is smallest at an end or where the
    excesses are equal.
    """
    between = (edges + np.append(edges[1:], edges[0] + np.pi)) / 2
    cos, sin = np.cos(between)[:, None], np.sin(between)[:, None]
    a = _chord(rim, cos * rim[0] - sin * rim[1])
    b = _chord(rim, sin * rim[0] + cos * rim[1])
    # width = a0 cos - a1 sin, depth = b0 sin + b1 cos
    p, q = a[0] - b[1], -a[1] - b[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = np.arccos(difference / np.hypot(p, q))
    angles = np.arctan2(q, p) + np.stack([offset, -offset])
    return np.asarray(angles[np.isfinite(angles)])


def _chord(rim: Floats, height: Floats) -> Floats:
    """(2, K) from the lowest to the highest point of the rim, for (K, N) heights."""
    return rim[:, height.argmax(axis=1)] - rim[:, height.argmin(axis=1)]
