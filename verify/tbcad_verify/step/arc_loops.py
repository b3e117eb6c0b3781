"""Loops of arcs, and those that bound the cell that faces the light.

A ball that is much larger than its neighbours may emerge behind them too, far from its apex. That
is the back of the union, a piece of its own, and not the mirror.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tbcad_verify.step.map_arcs import MapArcs, arc_length, form_along_circles, quadratic_roots
from tbcad_verify.types import Bools, Floats, Ints

CLOSED = 1e-8  # of the spread: maximum distance of one corner in two arcs
RAY = np.array([0.8137159, 0.5812531])  # not a direction of symmetry of any design


def arc_loops(arcs: MapArcs, spread: float) -> tuple[Ints, Bools]:
    """Follow N arcs, in ascending order of mirror, from end to start.

    Returns:
        (N,) number of each arc's loop, and whether it ends where no other of its cell begins.
    """
    start, end = arcs.point(arcs.s[0]), arcs.point(arcs.s[1])
    index, other = partners(arcs.mirror, arcs.mirror)
    gap = np.abs(start[:, other] - end[:, index]).max(axis=0)
    order = np.lexsort((gap, index))
    best = order[np.unique(index[order], return_index=True)[1]]
    count = len(arcs.mirror)
    graph = coo_array((np.ones(count, dtype=np.int8), (index[best], other[best])), (count, count))
    label = connected_components(graph, directed=False)[1].astype(np.intp)
    return label, ~(gap[best] <= CLOSED * spread)


def partners(mirror: Ints, among: Ints) -> tuple[Ints, Ints]:
    """All pairs (P,), (P,) of an item and one of the same mirror among others, which are sorted."""
    first, last = (np.searchsorted(among, mirror, side) for side in ("left", "right"))
    count = last - first
    index = np.repeat(np.arange(len(mirror)), count)
    return index, np.arange(len(index)) - np.repeat(np.cumsum(count) - count - first, count)


def front_pieces(arcs: MapArcs, spread: float) -> MapArcs:
    """Of each mirror only the piece nearest to its apex: its outer loop, and the holes in it."""
    label, _ = arc_loops(arcs, spread)
    outer = np.bincount(label, _swept(arcs))[label] > 0
    distance = np.hypot(*arcs.point(np.clip(0, *arcs.s)))
    order = np.lexsort((distance, arcs.mirror))
    order = order[outer[order]]
    nearest = order[np.unique(arcs.mirror[order], return_index=True)[1]]
    main = np.isin(label, label[nearest])
    hole = np.flatnonzero(~outer)
    y = arcs.take(hole).point(arcs.s[0, hole])
    enclosed = hole[inside(arcs.take(main), arcs.mirror[hole], y)]
    return arcs.take(main | np.isin(label, label[enclosed]))


def _swept(arcs: MapArcs) -> Floats:
    """(N,) twice the area on the map between each arc and the apex, mm^2; < 0 clockwise."""
    start, end = arcs.point(arcs.s[0]), arcs.point(arcs.s[1])
    bend_angle = arcs.bend * arcs.length  # to the right
    chord = start[0] * end[1] - start[1] * end[0]
    return np.asarray(chord - arcs.length**2 * bend_angle * _bulge(bend_angle))


def _bulge(bend_angle: Floats) -> Floats:
    """(turn - sin turn) / turn^3."""
    small = np.abs(bend_angle) < 1e-2
    safe = np.where(small, 1.0, bend_angle)
    return np.where(small, 1 / 6 - bend_angle**2 / 120, (safe - np.sin(safe)) / safe**3)


def inside(arcs: MapArcs, mirror: Ints, y: Floats) -> Bools:
    """Whether points y (2, P) of the maps of `mirror` (P,) lie within that mirror's loops.

    A ray from such a point crosses the loops an odd number of times.
    """
    index, other = partners(mirror, arcs.mirror)
    some, from_ = arcs.take(other), y[:, index]
    across = np.array([[-RAY[1]], [RAY[0]]])
    line = (np.zeros(len(other)), across + 0 * from_, -(across * from_).sum(axis=0))
    form = form_along_circles(some.near, some.inward, some.bend, line)
    crossings = np.zeros(len(mirror), dtype=np.intp)
    for t in quadratic_roots(form):
        hit = (t > some.t[0]) & (t < some.t[1]) & np.isfinite(t)
        there = some.point(arc_length(some.bend, np.where(hit, t, 0.0)))
        ahead = hit & ((RAY[:, None] * (there - from_)).sum(axis=0) > 0)
        crossings += np.bincount(index[ahead], minlength=len(mirror))
    return np.asarray(crossings % 2 == 1)
