"""Cells of many surfaces at once: which rings matter, and the arcs they leave.

A ring farther from the apex than every arc found without it cannot matter. So each mirror starts
with its nearest rings and takes more only until the rest are all beyond its cell; that is exact,
whatever the mirrors' sizes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import chunks
from tbcad_verify.step.charts import Charts, Rings, charts, rings, turned
from tbcad_verify.step.rims import Arcs, arcs, joined
from tbcad_verify.types import Bools, Floats, Ints

FIRST = 20
MOST_NUMBERS = 1_000_000  # in one array of intermediate results


@dataclass(frozen=True)
class Rims:
    """The cells of M mirrors, as arcs on their maps.

    Attributes:
        charts: the maps.
        arcs: in ascending order of mirror; `ring` is the other's number: mirrors, then walls, then
            the horizon.
        whole: (M,) a whole sphere that no other one cuts.
        spread: mm, how far apart things lie.
    """

    charts: Charts
    arcs: Arcs
    whole: Bools
    spread: float


@dataclass(frozen=True)
class Task:
    """Some mirrors' maps (M) with all that may cut them (T, and the horizon last).

    Attributes:
        index: (M,) the mirrors' numbers.
        charts: the maps.
        rings: (M, T + 1).
        near: (M, T + 1) mm, the order in which rings are taken; walls and horizon come first.
        spread: mm.
    """

    index: Ints
    charts: Charts
    rings: Rings
    near: Floats
    spread: float


def rims(mirrors: Surfaces, walls: Surfaces, front: bool) -> Rims:
    """The cells of mirrors in each other's company, cut by walls.

    With `front`, of each only what lies on the half that bulges along its normal.
    """
    spread, others = _spread(mirrors, walls), both(mirrors, walls)
    maps = charts(mirrors if front else turned(mirrors, others), front, spread)
    whole = np.zeros(len(maps.reach), dtype=np.bool_)
    found: list[Arcs] = []
    for task in _tasks(maps, others, spread):
        whole[task.index] = ~(task.rings.covers | task.rings.real).any(axis=1)
        for row, some in _solved(task, np.arange(len(task.index)), FIRST):
            found.append(replace(some, mirror=task.index[row][some.mirror]))
    every = joined(found)
    return Rims(maps, every.take(np.argsort(every.mirror, kind="stable")), whole, spread)


def both(one: Surfaces, other: Surfaces) -> Surfaces:
    """Surfaces of both, in this order."""
    return Surfaces(
        np.concatenate([one.point, other.point], axis=1),
        np.concatenate([one.normal, other.normal], axis=1),
        np.concatenate([one.curvature, other.curvature]),
    )


def _spread(mirrors: Surfaces, walls: Surfaces) -> float:
    """How far apart things lie, mm: the unit in which sizes are compared."""
    offset = (walls.normal * walls.point).sum(axis=0)
    away = np.abs(np.einsum("iw,im->wm", walls.normal, mirrors.point) - offset[:, None])
    curved = mirrors.curvature[mirrors.curvature > 0]
    if not len(mirrors.curvature):
        return 1.0
    size = float(np.hypot.reduce([*np.ptp(mirrors.point, axis=1), away.max(initial=0.0)]))
    return size or (1 / float(curved.max()) if len(curved) else 1.0)


def _tasks(maps: Charts, others: Surfaces, spread: float) -> Iterator[Task]:
    """All maps, some at a time; walls come after the mirrors among the others."""
    count, total = len(maps.reach), len(others.curvature)
    wall = np.arange(total + 1) >= count
    for part in chunks(count, max(1, MOST_NUMBERS // (total + 1))):
        index = np.arange(count)[part]
        some = maps.take(index)
        every = rings(some, index, others, spread)
        yield Task(index, some, every, np.where(wall, -np.inf, every.clearance), spread)


def _solved(task: Task, row: Ints, width: int) -> Iterator[tuple[Ints, Arcs]]:
    """Rows of the task (R,) and their arcs, which count rows within R, in batches."""
    width = min(width, task.near.shape[1])
    for part in chunks(len(row), max(1, MOST_NUMBERS // (2 * width**2))):
        column = _nearest(task.near[row[part]], width)
        some = arcs(task.rings.rows(row[part]).take(column), task.spread)
        short = _farther(task, row[part], some) > width
        numbered = replace(some, ring=column[some.mirror, some.ring])
        yield row[part], numbered.take(~short[some.mirror])
        if short.any():
            yield from _solved(task, row[part][short], 2 * width)


def _nearest(near: Floats, width: int) -> Ints:
    """(M, width) numbers of the least of (M, K), in ascending order of number."""
    if width == near.shape[1]:
        return np.broadcast_to(np.arange(width), near.shape)
    return np.sort(np.argpartition(near, width, axis=1)[:, :width], axis=1)


def _farther(task: Task, row: Ints, some: Arcs) -> Ints:
    """(R,) how many rings come nearer to the apex than the farthest point of the arcs so far."""
    reach = np.zeros(len(row))
    for s in some.s:
        np.maximum.at(reach, some.mirror, np.hypot(*some.point(s)))
    endless = np.isinf(task.charts.reach[row])
    return np.asarray((task.near[row] <= np.where(endless, np.inf, reach)[:, None]).sum(axis=1))
