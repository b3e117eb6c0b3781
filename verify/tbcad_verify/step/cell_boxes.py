"""Exact bounding boxes of cells: corners, extreme points of arcs, and poles inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.step.arc_loops import inside
from tbcad_verify.step.map_arcs import MapArcs, arc_length, quadratic_roots
from tbcad_verify.step.stereographic import SurfaceMaps, to_surface
from tbcad_verify.types import Floats

OPPOSITE_COS = -1 + 1e-9  # the point opposite the apex, which no map shows


def cell_boxes(maps: SurfaceMaps, arcs: MapArcs) -> Floats:
    """(M, 2, 3) minimum and maximum x, y, z of the cells of M maps, mm; (inf, -inf) for none."""
    mine = maps.take(arcs.mirror)
    box = np.empty((len(maps.reach), 2, 3))
    box[:, 0], box[:, 1] = np.inf, -np.inf
    for s in arcs.s:
        _grow(box, arcs.mirror, to_surface(mine, arcs.point(s)))
    for axis in range(3):
        _grow_by_arcs(box, maps, arcs, axis)
        for sign in (-1.0, 1.0):
            _grow_by_pole(box, maps, arcs, axis, sign)
    return box


def _grow(box: Floats, mirror: NDArray[np.intp], x: Floats) -> None:
    """Extend the boxes of mirrors (N,) to points (3, N)."""
    np.minimum.at(box[:, 0], mirror, x.T)
    np.maximum.at(box[:, 1], mirror, x.T)


def _grow_by_arcs(box: Floats, maps: SurfaceMaps, arcs: MapArcs, axis: int) -> None:
    """Both points of each circle where this coordinate is extreme, if they lie on the arc.

    Along the circle the coordinate is a quotient of quadratics, and the numerator of its derivative
    a quadratic.
    """
    mine = maps.take(arcs.mirror)
    k, zero = mine.surfaces.curvature, np.zeros_like(arcs.bend)
    e = np.stack([mine.right[axis], mine.up[axis]])
    a = arcs.form(-k / 2 * mine.surfaces.normal[axis], e, zero)
    b = arcs.form(k**2 / 4, 0 * e, zero + 1)
    slope = [a[1] * b[0] - a[0] * b[1], 2 * (a[2] * b[0] - a[0] * b[2]), a[2] * b[1] - a[1] * b[2]]
    for t in quadratic_roots(np.stack(slope)):
        on = np.flatnonzero((t > arcs.t[0]) & (t < arcs.t[1]) & np.isfinite(t))
        some = arcs.take(on)
        y = some.point(arc_length(some.bend, t[on]))
        _grow(box, some.mirror, to_surface(maps.take(some.mirror), y))


def _grow_by_pole(box: Floats, maps: SurfaceMaps, arcs: MapArcs, axis: int, sign: float) -> None:
    """The point of the sphere that is farthest along an axis, if it lies in the cell."""
    s = maps.surfaces
    right, up, normal = (sign * e[axis] for e in (maps.right, maps.up, s.normal))
    index = np.flatnonzero((s.curvature > 0) & (normal > OPPOSITE_COS))
    y = np.stack([right, up])[:, index] * 2 / (s.curvature * (1 + normal))[index]
    within = inside(arcs, index, y)
    _grow(box, index[within], to_surface(maps.take(index[within]), y[:, within]))
