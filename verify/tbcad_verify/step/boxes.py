"""Exact bounding boxes of cells: corners, arcs' extreme points, poles inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.step.charts import Charts, lift
from tbcad_verify.step.loops import inside
from tbcad_verify.step.rims import Arcs, arc_length, roots
from tbcad_verify.types import Floats

BEHIND = -1 + 1e-9  # the point that no map shows


def boxes(charts: Charts, arcs: Arcs) -> Floats:
    """(M, 2, 3) least and greatest x, y, z of the cells of M maps, mm; (inf, -inf) for none."""
    mine = charts.take(arcs.mirror)
    box = np.empty((len(charts.reach), 2, 3))
    box[:, 0], box[:, 1] = np.inf, -np.inf
    for s in arcs.s:
        _grow(box, arcs.mirror, lift(mine, arcs.point(s)))
    for axis in range(3):
        _grow_by_arcs(box, charts, arcs, axis)
        for sign in (-1.0, 1.0):
            _grow_by_pole(box, charts, arcs, axis, sign)
    return box


def _grow(box: Floats, mirror: NDArray[np.intp], x: Floats) -> None:
    """Take points (3, N) of the mirrors (N,) into their boxes."""
    np.minimum.at(box[:, 0], mirror, x.T)
    np.maximum.at(box[:, 1], mirror, x.T)


def _grow_by_arcs(box: Floats, charts: Charts, arcs: Arcs, axis: int) -> None:
    """Both points of each circle where this coordinate is extreme, if they lie on the arc.

    Along the circle the coordinate is a quotient of quadratics; its derivative is one more.
    """
    mine = charts.take(arcs.mirror)
    k, zero = mine.surfaces.curvature, np.zeros_like(arcs.bend)
    e = np.stack([mine.right[axis], mine.up[axis]])
    a = arcs.form(-k / 2 * mine.surfaces.normal[axis], e, zero)
    b = arcs.form(k**2 / 4, 0 * e, zero + 1)
    slope = [a[1] * b[0] - a[0] * b[1], 2 * (a[2] * b[0] - a[0] * b[2]), a[2] * b[1] - a[1] * b[2]]
    for t in roots(np.stack(slope)):
        on = np.flatnonzero((t > arcs.t[0]) & (t < arcs.t[1]) & np.isfinite(t))
        some = arcs.take(on)
        y = some.point(arc_length(some.bend, t[on]))
        _grow(box, some.mirror, lift(charts.take(some.mirror), y))


def _grow_by_pole(box: Floats, charts: Charts, arcs: Arcs, axis: int, sign: float) -> None:
    """The point of the sphere that is farthest along an axis, if it lies in the cell."""
    s = charts.surfaces
    right, up, normal = (sign * e[axis] for e in (charts.right, charts.up, s.normal))
    index = np.flatnonzero((s.curvature > 0) & (normal > BEHIND))
    y = np.stack([right, up])[:, index] * 2 / (s.curvature * (1 + normal))[index]
    within = inside(arcs, index, y)
    _grow(box, index[within], lift(charts.take(index[within]), y[:, within]))
