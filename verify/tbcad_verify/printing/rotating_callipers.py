"""The rotation about the vertical by which a part fits a rectangle, by rotating callipers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from tbcad_verify.types import Floats


@dataclass(frozen=True)
class Silhouette:
    """A part seen from above."""

    rim: Floats  # (2, N) corners of the convex hull, mm
    # (K,) rotations that bring an edge of the rim to lie along x or y, rad, ascending
    turns: Floats
    sides: Floats  # (2, K) extents along x and y after each, mm


def silhouette(points: Floats) -> Silhouette:
    """The silhouette of points (2, N), mm."""
    rim = points[:, ConvexHull(points.T).vertices]
    turns = _edges(rim)
    return Silhouette(rim, turns, _sides(rim, turns))


def best_rotation(
    seen: Silhouette, width: float, depth: float, slack: float
) -> tuple[float, Floats]:
    """The best rotation, and the sides of the box after it.

    The smallest of the enclosing rectangles that fit; if none of those with a side along an edge
    fits, the rotation with the smallest excess over width or depth, whichever is larger.

    Args:
        seen: from above.
        width: of the rectangle along x, mm.
        depth: along y, mm.
        slack: by how much the sides may be exceeded, mm.

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


def _edges(rim: Floats) -> Floats:
    """Rotations that bring an edge of the rim to lie along x or y, ascending."""
    edge = np.roll(rim, -1, axis=1) - rim
    across = np.mod(-np.arctan2(edge[1], edge[0]), np.pi / 2)
    return _canonical(np.concatenate([across, across + np.pi / 2]))


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
