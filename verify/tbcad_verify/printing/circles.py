"""Circles through many groups of points in the plane at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.types import Floats

Groups = NDArray[np.int32]


def fit_circles(points: Floats, group: Groups, count: int) -> tuple[Floats, Floats]:
    """Least-squares circle of each group; not finite where the points lie on a line.

    Args:
        points: (2, N).
        group: (N,) 0 ... G - 1, each with at least one point.
        count: G.

    Returns:
        (2, G) centres and (G,) radii.

    Source: I. Kasa, A Circle Fitting Procedure and Its Error Analysis, 1976.
    """

    def mean(values: Floats) -> Floats:
        return np.asarray(np.bincount(group, values, count) / size)

    size = np.bincount(group, minlength=count)
    middle = np.stack([mean(row) for row in points])
    x, y = points - middle[:, group]  # about the middle, so that large terms do not cancel
    square = x * x + y * y
    xx, xy, yy = mean(x * x), mean(x * y), mean(y * y)
    p, q = mean(x * square) / 2, mean(y * square) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = np.stack([p * yy - q * xy, q * xx - p * xy]) / (xx * yy - xy * xy)
        return middle + offset, np.sqrt(offset[0] ** 2 + offset[1] ** 2 + xx + yy)


def widest_gaps(angle: Floats, group: Groups, count: int) -> Floats:
    """(G,) the widest gap between neighbouring angles of each group, rad; 2 pi of empty groups.

    Args:
        angle: (N,) from -pi to pi; those that are not finite are left out.
        group: (N,) 0 ... G - 1.
        count: G.
    """
    angle, group = angle[np.isfinite(angle)], group[np.isfinite(angle)]
    order = np.lexsort((angle, group))
    angle, group = angle[order], group[order]
    widest = np.full(count, 2 * np.pi)
    if not group.size:
        return widest
    first = np.flatnonzero(np.diff(group, prepend=-1))
    last = np.append(first[1:], group.size) - 1
    step = np.diff(angle, append=0.0)
    step[last] = angle[first] + 2 * np.pi - angle[last]
    widest[group[first]] = np.maximum.reduceat(step, first)
    return widest
