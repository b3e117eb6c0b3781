"""Corners of pedestals at the seam and the foot plane.

No third mirror ends in a corner on such a plane: its walls would lean beyond it. Where its border
with the plane is too short, its two neighbours meet instead. Their groove runs from the plane
toward the mirror's apex, and becomes longer until its sides are long enough and its bottom ends
before the plane.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.step.pedestal_graph import Graph, Mirrors, unit
from tbcad_verify.types import Bools, Ints


@dataclass(frozen=True)
class _Groove:
    """A border of two mirrors from a corner on a plane to one of three mirrors.

    Attributes:
        length: mm.
        on_plane: corner.
        above: corner.
        mirror: the third one there.
    """

    length: float
    on_plane: int
    above: int
    mirror: int


@dataclass(frozen=True)
class _Short:
    """A mirror's border with a plane, between two mirrors that do not meet.

    Attributes:
        length: mm.
        row: of the border.
        before: neighbour at its start.
        after: neighbour at its end.
    """

    length: float
    row: int
    before: int
    after: int


def without_crowded_corners(mirrors: Mirrors, graph: Graph, group: Ints, rise: float) -> Graph:
    """Borders when corners are joined to groups (C,), of which fewer on planes have three mirrors.

    The same object if none has. A groove becomes longer by `rise`, mm.
    """
    count = len(mirrors.point)
    corner = group[graph.ends]
    vanishing = [one for one in _short_borders(graph, count) if np.ptp(corner[one.row]) == 0]
    # Of each group the shortest: it is put in last.
    best = {
        int(corner[one.row, 0]): one for one in sorted(vanishing, key=lambda short: -short.length)
    }
    for one in best.values():
        graph = _met(graph, one)
    gone = [one for one in _grooves(graph, count) if group[one.on_plane] == group[one.above]]
    return _longer(mirrors, graph, gone, rise)


def with_corners_farther_off(mirrors: Mirrors, graph: Graph, near: Bools, rise: float) -> Graph:
    """Borders whose corners that are too near to a plane (C,) lie farther from it, by `rise` mm.

    The same object if no groove runs from one to a plane.
    """
    grooves = [one for one in _grooves(graph, len(mirrors.point)) if near[one.above]]
    return _longer(mirrors, graph, grooves, rise)


def _meeting(graph: Graph) -> list[set[int]]:
    """Faces that meet at each corner."""
    at: list[set[int]] = [set() for _ in graph.place]
    for faces, ends in zip(graph.faces.tolist(), graph.ends.tolist(), strict=True):
        for corner in ends:
            at[corner].update(faces)
    return at


def _short_borders(graph: Graph, count: int) -> list[_Short]:
    at, length = _meeting(graph), graph.length
    present = {frozenset(pair) for pair in graph.faces.tolist()}
    found = []
    for row in np.flatnonzero(graph.faces[:, 1] >= count).tolist():
        faces = {*graph.faces[row].tolist()}
        third = [at[corner] - faces for corner in graph.ends[row].tolist()]
        if [len(one) for one in third] != [1, 1]:
            continue
        before, after = (next(iter(one)) for one in third)
        if max(before, after) < count and frozenset((before, after)) not in present:
            found.append(_Short(float(length[row]), row, before, after))
    return found


def _met(graph: Graph, short: _Short) -> Graph:
    """Borders in which the neighbours at the ends of a short one meet in its middle."""
    place, faces, ends = graph.place.copy(), graph.faces.copy(), graph.ends.copy()
    mirror, plane = faces[short.row].tolist()
    above, on_plane = ends[short.row].tolist()
    place[[above, on_plane]] = place[[above, on_plane]].mean(axis=0)
    for pair, old, new in (
        ((mirror, short.after), on_plane, above),
        ((short.before, plane), above, on_plane),
    ):
        row = np.flatnonzero((np.sort(faces, axis=1) == sorted(pair)).all(axis=1))
        ends[row] = np.where(ends[row] == old, new, ends[row])
    faces[short.row] = short.after, short.before
    return replace(graph, place=place, faces=faces, ends=ends)


def _grooves(graph: Graph, count: int) -> list[_Groove]:
    at, length, found = _meeting(graph), graph.length, []
    for row in np.flatnonzero((graph.faces < count).all(axis=1)).tolist():
        faces = {*graph.faces[row].tolist()}
        a, b = graph.ends[row].tolist()
        for on_plane, above in ((a, b), (b, a)):
            plane, mirror = at[on_plane] - faces, at[above] - faces
            if len(plane) == len(mirror) == 1 and min(plane) >= count > min(mirror):
                found.append(_Groove(float(length[row]), on_plane, above, min(mirror)))
    return found


def _longer(mirrors: Mirrors, graph: Graph, grooves: list[_Groove], rise: float) -> Graph:
    """Borders with these grooves longer; the shortest counts where two end in one corner."""
    if not grooves:
        return graph
    place = graph.place.copy()
    for one in sorted(grooves, key=lambda groove: -groove.length):
        foot = graph.place[one.on_plane]
        place[one.above] = foot + (one.length + rise) * unit(mirrors.point[one.mirror] - foot)
    return replace(graph, place=place)
