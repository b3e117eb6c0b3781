"""Triangles of polygons."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.types import Floats, Ints


def triangles(counts: Ints, points: Floats) -> tuple[Ints, Ints]:
    """Cut polygons into triangles; those that are not convex are cut by their outline.

    Args:
        counts: corners of each polygon, (p,).
        points: of all corners, one polygon after the other, (sum of counts, 3).

    Returns:
        Numbers of corners (t, 3) of triangles, and their polygons (t,), ascending. Polygons of one
        or two corners give none.
    """
    begin = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
    number = np.maximum(counts - 2, 0)
    polygon = np.repeat(np.arange(len(counts)), number)
    step = np.arange(len(polygon)) - np.repeat(np.cumsum(number) - number, number)
    first = begin[polygon]
    corners = np.column_stack([first, first + step + 1, first + step + 2])
    for bad in _not_convex(counts, polygon, points[corners]):
        own = points[begin[bad] : begin[bad] + counts[bad]]
        cut = _cut(own)
        if len(cut) == number[bad]:
            corners[polygon == bad] = begin[bad] + cut
    return corners, polygon


def _not_convex(counts: Ints, polygon: Ints, corners: Floats) -> list[int]:
    """Polygons of which a triangle of the fan is turned against the whole."""
    if len(polygon) == len(counts):
        return []
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    whole = np.zeros((len(counts), 3))
    np.add.at(whole, polygon, across)
    turned = np.einsum("tx,tx->t", across, whole[polygon]) < 0
    return [int(bad) for bad in np.unique(polygon[turned])]


def _cut(points: Floats) -> NDArray[Any]:
    """Triangles (t, 3) of one flat polygon (k, 3)."""
    from manifold3d import triangulate

    middle = points - points.mean(axis=0)
    axes = np.linalg.svd(middle, full_matrices=False)[2][:2]
    flat = middle @ axes.T
    x, y = flat.T
    order = np.arange(len(flat))
    if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0:
        order = order[::-1]
    cut = np.asarray(triangulate([flat[order]]), dtype=np.int64).reshape(-1, 3)
    turned = order[cut]
    return turned if order[0] == 0 else turned[:, ::-1]
