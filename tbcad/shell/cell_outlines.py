"""Vertices on the arcs, and the closed outline of them round each cell."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.optics.cells import Cells
from tbcad.types import Bools, Floats, Ints


@dataclass(frozen=True)
class CellOutlines:
    """Vertices of e arcs, and outlines of the cells with b places in all.

    Outlines run counter-clockwise seen from outside, one cell after another. A vertex is at one
    place in the outline of each cell that it belongs to.
    """

    vertices: Floats  # mm, (v, 3); corners first, then the arcs' inner points
    first_inner: Ints  # first inner vertex of each arc, (e,)
    segments: Ints  # number of segments of each arc, (e,)
    start: Ints  # vertex at the start of each arc, (e,)
    end: Ints  # vertex at its end, (e,)
    cell: Ints  # whose outline each place is in, (b,)
    vertex: Ints  # at each place, (b,)
    following: Ints  # next place of the same outline, (b,)
    corner: Bools  # whether two arcs meet at the place, (b,)
    last_segment: Bools  # whether the last segment of an arc begins there, (b,)

    @property
    def points(self) -> Floats:
        """Point at each place, mm, (b, 3)."""
        return self.vertices[self.vertex]

    def at(self, arc: Ints, step: Ints) -> Ints:
        """Vertices (k,) that many segments from the starts of arcs (k,)."""
        inner = self.first_inner[arc] + step - 1
        last = np.where(step == self.segments[arc], self.end[arc], inner)
        return np.where(step == 0, self.start[arc], last)

    def along(self, chain: list[tuple[int, bool]]) -> Ints:
        """Vertices along a chain of arcs and whether each runs forward, its ends included."""
        lines = [self._line(arc, forward) for arc, forward in chain]
        return np.concatenate([lines[0][:1], *(line[1:] for line in lines)])

    def _line(self, arc: int, forward: bool) -> Ints:
        inner = self.first_inner[arc] + np.arange(self.segments[arc] - 1)
        line = np.concatenate([self.start[[arc]], inner, self.end[[arc]]])
        return line if forward else line[::-1]


def cell_outlines(cells: Cells, segments: Ints) -> CellOutlines:
    """Vertices and outlines for arcs cut into so many segments each (e,)."""
    arcs = cells.arcs
    used, index = np.unique(np.concatenate([arcs.start, arcs.end]), return_inverse=True)
    start, end = index[: len(arcs)], index[len(arcs) :]
    first_inner = len(used) + np.concatenate([[0], np.cumsum(segments - 1)[:-1]])
    arc, k = rows_and_columns(segments - 1)
    vertices = np.concatenate([cells.corners[used], arcs.at(arc, (k + 1) / segments[arc])])

    offsets, sides = cells.rings
    side, k = rows_and_columns(segments[sides // 2])
    arc, backward = sides[side] // 2, sides[side] % 2 == 1
    inner = first_inner[arc] + np.where(backward, segments[arc] - k, k) - 1
    vertex = np.where(k == 0, np.where(backward, end[arc], start[arc]), inner)
    cell = np.repeat(np.arange(cells.mirrors), np.diff(offsets))[side]
    return CellOutlines(
        vertices,
        first_inner,
        segments,
        start,
        end,
        cell,
        vertex,
        following=_following(cell),
        corner=k == 0,
        last_segment=k == segments[arc] - 1,
    )


def rows_and_columns(counts: Ints) -> tuple[Ints, Ints]:
    """Row and column of every element of rows with these many elements each."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def _following(cell: Ints) -> Ints:
    begins = np.searchsorted(cell, cell, side="left")
    last = np.append(cell[1:] != cell[:-1], True)
    return np.where(last, begins, np.arange(len(cell)) + 1)
