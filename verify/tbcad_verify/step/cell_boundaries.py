"""Cells of many surfaces at once: the circles that bound them, the arcs, and their loops.

A circle farther from the apex than every arc found without it does not bound the cell. So each
mirror starts with its nearest circles, and takes more only until all others are beyond its cell.
This is exact, whatever the mirrors' sizes. A ball that is much larger than its neighbours may
emerge behind them too, far from its apex: a piece of its own, and not the mirror.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.mesh.mesh import connected_groups
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import chunks, joined
from tbcad_verify.step.map_arcs import (
    MapArcs,
    arc_length,
    form_along_circles,
    free_arcs,
    joined_arcs,
    quadratic_roots,
)
from tbcad_verify.step.stereographic import MapCircles, SurfaceMaps, map_circles, surface_maps
from tbcad_verify.types import Bools, Floats, Ints

FIRST = 20  # circles that each mirror starts with
MOST_NUMBERS = 1_000_000  # in one array of intermediate results
CLOSED = 1e-8  # of the spread: maximum distance of one corner in two arcs
RAY = np.array([0.8137159, 0.5812531])  # not a direction of symmetry of any design


@dataclass(frozen=True)
class CellBoundaries:
    """The cells of M mirrors, as arcs on their maps."""

    maps: SurfaceMaps  # of the mirrors
    # in ascending order of mirror; `circle` is the number of the other surface: mirrors, walls,
    # then the horizon
    arcs: MapArcs
    spread: float  # extent of all surfaces, mm


@dataclass(frozen=True)
class MapBatch:
    """Some mirrors' maps (M) with all surfaces that may cut them (T, and the horizon last)."""

    index: Ints  # (M,) the mirrors' numbers
    maps: SurfaceMaps  # of the mirrors
    circles: MapCircles  # (M, T + 1)
    # (M, T + 1) mm, the order in which circles are taken; walls and horizon come first
    near: Floats
    spread: float  # mm


def cell_boundaries(mirrors: Surfaces, walls: Surfaces) -> CellBoundaries:
    """The cells that mirrors leave each other, cut by walls, on the half toward the normal."""
    spread, others = _spread(mirrors, walls), joined([mirrors, walls])
    maps = surface_maps(mirrors, spread)
    arcs = [
        replace(some, mirror=batch.index[row][some.mirror])
        for batch in _batches(maps, others, spread)
        for row, some in _solved(batch, np.arange(len(batch.index)), FIRST)
    ]
    every = joined_arcs(arcs)
    return CellBoundaries(maps, every.take(np.argsort(every.mirror, kind="stable")), spread)


def _spread(mirrors: Surfaces, walls: Surfaces) -> float:
    """Extent of all surfaces, mm: the unit in which sizes are compared."""
    offset = (walls.normal * walls.point).sum(axis=0)
    distance = np.abs(np.einsum("iw,im->wm", walls.normal, mirrors.point) - offset[:, None])
    curved = mirrors.curvature[mirrors.curvature > 0]
    if not len(mirrors.curvature):
        return 1.0
    size = float(np.hypot.reduce([*np.ptp(mirrors.point, axis=1), distance.max(initial=0.0)]))
    return size or (1 / float(curved.max()) if len(curved) else 1.0)


def _batches(maps: SurfaceMaps, others: Surfaces, spread: float) -> Iterator[MapBatch]:
    """All maps, some at a time; walls come after the mirrors among the others."""
    count, total = len(maps.reach), len(others.curvature)
    wall = np.arange(total + 1) >= count
    for part in chunks(count, max(1, MOST_NUMBERS // (total + 1))):
        index = np.arange(count)[part]
        some = maps.take(index)
        every = map_circles(some, index, others, spread)
        yield MapBatch(index, some, every, np.where(wall, -np.inf, every.clearance), spread)


def _solved(batch: MapBatch, row: Ints, width: int) -> Iterator[tuple[Ints, MapArcs]]:
    """Rows of the batch (R,) and their arcs, which count rows within R, in batches."""
    width = min(width, batch.near.shape[1])
    for part in chunks(len(row), max(1, MOST_NUMBERS // (2 * width**2))):
        column = _nearest(batch.near[row[part]], width)
        some = free_arcs(batch.circles.rows(row[part]).take(column), batch.spread)
        short = _farther(batch, row[part], some) > width
        numbered = replace(some, circle=column[some.mirror, some.circle])
        yield row[part], numbered.take(~short[some.mirror])
        if short.any():
            yield from _solved(batch, row[part][short], 2 * width)


def _nearest(near: Floats, width: int) -> Ints:
    """(M, width) numbers of the smallest of (M, K), in ascending order of number."""
    if width == near.shape[1]:
        return np.broadcast_to(np.arange(width), near.shape)
    return np.sort(np.argpartition(near, width, axis=1)[:, :width], axis=1)


def _farther(batch: MapBatch, row: Ints, some: MapArcs) -> Ints:
    """(R,) how many circles come nearer to the apex than the farthest point of the arcs so far."""
    reach = np.zeros(len(row))
    for s in some.s:
        np.maximum.at(reach, some.mirror, np.hypot(*some.point(s)))
    endless = np.isinf(batch.maps.reach[row])
    return np.asarray((batch.near[row] <= np.where(endless, np.inf, reach)[:, None]).sum(axis=1))


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
    label = connected_groups(len(arcs.mirror), index[best], other[best])[1].astype(np.intp)
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
