"""Vertices on the arcs, and the closed line of them round each cell."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.optics.cells import Cells
from tbcad.spec.design import Spec
from tbcad.types import Floats, Ints

LEAST_STEPS = 3


@dataclass(frozen=True)
class Rim:
    """Vertices of all arcs over e arcs, and lines of b places.

    Lines run counter-clockwise seen from outside, one cell after another.

    Attributes:
        vertices: mm, (v, 3); corners first, then the arcs' inner points.
        first: first inner vertex of each arc, (e,).
        steps: segments of each arc, (e,).
        start: vertex at the start of each arc, (e,).
        end: vertex at its end, (e,).
        cell: whose line each place is in, (b,).
        line: vertex at each place, (b,).
        following: next place of the same line, (b,).
        corner: where two arcs meet, (b,).
        late: where the last segment of an arc begins, (b,).
    """

    vertices: Floats
    first: Ints
    steps: Ints
    start: Ints
    end: Ints
    cell: Ints
    line: Ints
    following: Ints
    corner: NDArray[np.bool_]
    late: NDArray[np.bool_]


def arc_vertices(cells: Cells, steps: Ints) -> Rim:
    """Vertices and lines for arcs cut into so many segments each (e,)."""
    arcs = cells.arcs
    used, place = np.unique(np.concatenate([arcs.start, arcs.end]), return_inverse=True)
    start, end = place[: len(arcs)], place[len(arcs) :]
    first = len(used) + np.concatenate([[0], np.cumsum(steps - 1)[:-1]])
    arc, k = _ragged(steps - 1)
    vertices = np.concatenate([cells.corners[used], arcs.at(arc, (k + 1) / steps[arc])])

    offsets, sides = cells.rings
    side, k = _ragged(steps[sides // 2])
    arc, back = sides[side] // 2, sides[side] % 2 == 1
    inner = first[arc] + np.where(back, steps[arc] - k, k) - 1
    line = np.where(k == 0, np.where(back, end[arc], start[arc]), inner)
    cell = np.repeat(np.arange(cells.mirrors), np.diff(offsets))[side]
    late = k == steps[arc] - 1
    return Rim(vertices, first, steps, start, end, cell, line, _following(cell), k == 0, late)


def segment_counts(spec: Spec, cells: Cells, distance: Floats) -> Ints:
    """Segments of each arc (e,), for the mirror that needs more of the two.

    A facet keeps one normal along its segment of length s, so the rays at its ends shift by
    s (distance / r) along the rim's image. Near where that image comes closest to the object's
    centre it turns about the circle of radius R: a shift d costs d^2 / 2 R of coverage's radius.
    """
    curvature = cells.surfaces.curvature[: cells.mirrors]
    shift = np.sqrt(spec.optics.capture_diameter_mm * spec.mesh.ray_error_mm)
    with np.errstate(divide="ignore"):
        by_rays = shift / (curvature * distance)
        by_chord = np.sqrt(4 * spec.mesh.chord_error_mm / curvature)
    longest = np.full(len(cells.surfaces), np.inf)
    longest[: cells.mirrors] = np.minimum(by_rays, by_chord)
    arcs = cells.arcs
    steps = np.ceil(arcs.length / longest[arcs.faces].min(axis=1))
    straight = arcs.weight == 1
    return np.where(straight, 1, np.maximum(steps, LEAST_STEPS)).astype(np.int64)


def _ragged(counts: Ints) -> tuple[Ints, Ints]:
    """Row and place in the row of every element of rows with these counts."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def _following(cell: Ints) -> Ints:
    place = np.arange(len(cell))
    begins = np.searchsorted(cell, cell, side="left")
    last = np.append(cell[1:] != cell[:-1], True)
    return np.where(last, begins, place + 1)
