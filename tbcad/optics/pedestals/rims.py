"""Corners of pedestals near the seam and the foot plane.

A mirror whose border with a bounding plane is too short for the grooves at its ends cannot end in
one corner on that plane: walls lean with the light, so its tip would stick out beyond the plane. It
ends before the plane instead, and its two neighbours have a groove from there to the plane.
"""

from dataclasses import replace

import numpy as np

from tbcad.geometry.vectors import norm, unit
from tbcad.optics.cells import Cells
from tbcad.optics.power_diagram import flip_edges, half_edges, opposite
from tbcad.types import Bools, Floats, Ints


def without_crowded_rims(cells: Cells, corner: Ints, rise: float) -> Cells:
    """Cells in which fewer joined corners on a bounding plane have a third mirror.

    Args:
        cells: of planar mirrors.
        corner: that each triangle's corner becomes when short borders' corners are joined, (t,).
        rise: how much longer a groove to a plane becomes, mm.

    Returns:
        The same object when there is no such corner.
    """
    short = _vanishing(_borders_with_planes(cells), cells, corner)
    short = _shortest_of_each(short, cells, corner[short // 3])
    flipped = _flipped(cells, short) if len(short) else cells
    return _raised(flipped, _vanishing(_grooves_to_planes(flipped), flipped, corner), rise)


def with_longer_grooves_to_planes(cells: Cells, too_near: Bools, rise: float) -> Cells:
    """Cells whose corners that are too near to a bounding plane (t,) are farther from it.

    Args:
        cells: of planar mirrors.
        too_near: which triangles' corners are, (t,).
        rise: how much longer the groove from there to the plane becomes, mm.

    Returns:
        The same object when no groove runs from such a corner to a plane.
    """
    _, twin = half_edges(cells.triangles)
    edge = _grooves_to_planes(cells)
    return _raised(cells, edge[too_near[twin[edge] // 3]], rise)


def _borders_with_planes(cells: Cells) -> Ints:
    """Edges from mirrors to a plane, between two mirrors that could meet instead, (e,)."""
    ends, twin = half_edges(cells.triangles)
    third = opposite(cells.triangles, np.arange(len(ends)))
    between, key = np.column_stack([third, third[twin]]), [len(cells.surfaces), 1]
    borders = (ends[:, 0] < cells.mirrors) & (ends[:, 1] >= cells.mirrors)
    borders &= (between < cells.mirrors).all(axis=1)
    borders &= ~np.isin(between @ key, ends @ key)
    return np.flatnonzero(borders)


def _grooves_to_planes(cells: Cells) -> Ints:
    """Edges between mirrors, with a plane in their triangle and a mirror across, (e,)."""
    ends, twin = half_edges(cells.triangles)
    third = opposite(cells.triangles, np.arange(len(ends)))
    inner = (ends < cells.mirrors).all(axis=1)
    return np.flatnonzero(inner & (third >= cells.mirrors) & (third[twin] < cells.mirrors))


def _vanishing(edge: Ints, cells: Cells, corner: Ints) -> Ints:
    """Those of the directed edges (e,) that have one joined corner at both ends."""
    _, twin = half_edges(cells.triangles)
    return np.asarray(edge[corner[edge // 3] == corner[twin[edge] // 3]])


def _shortest_of_each(edge: Ints, cells: Cells, group: Ints) -> Ints:
    """The edge with the shortest border of each group, of directed edges in groups (e,)."""
    _, twin = half_edges(cells.triangles)
    order = np.argsort(_lengths(cells, edge // 3, twin[edge] // 3), kind="stable")
    return np.asarray(edge[order][np.unique(group[order], return_index=True)[1]])


def _lengths(cells: Cells, one: Ints, other: Ints) -> Floats:
    """Distances of the corners of triangles (e,) and others, mm, (e,)."""
    return np.asarray(norm(cells.corners[one] - cells.corners[other]))


def _flipped(cells: Cells, edge: Ints) -> Cells:
    """Cells without these borders (e,) of mirrors with a plane; the neighbours meet instead."""
    triangles, corners = cells.triangles.copy(), cells.corners.copy()
    _, twin = half_edges(triangles)
    ends = np.stack([edge, twin[edge]]) // 3
    flip_edges(triangles, edge, twin[edge])
    corners[ends] = corners[ends].mean(axis=0)
    return replace(cells, triangles=triangles, corners=corners)


def _raised(cells: Cells, edge: Ints, rise: float) -> Cells:
    """Cells whose grooves to a plane (e,) begin farther from it, toward the mirror above.

    Returns:
        The same object when there are none.
    """
    if not len(edge):
        return cells
    _, twin = half_edges(cells.triangles)
    edge = _shortest_of_each(edge, cells, twin[edge] // 3)
    corners, on_plane, above = cells.corners.copy(), edge // 3, twin[edge] // 3
    apex = cells.surfaces.apex[opposite(cells.triangles, twin[edge])]
    length = _lengths(cells, above, on_plane) + rise
    corners[above] = corners[on_plane] + length[:, None] * unit(apex - corners[on_plane])
    return replace(cells, corners=corners)
