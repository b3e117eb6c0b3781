"""Facets of the mirrors: rings of quads on each sphere, with a thin strip along the outline.

A facet reflects like a flat mirror whose normal is the sphere's at the facet's circumcentre. For
a right-angled triangle that is the middle of its longest side: in a strip of width w along the
outline, cut into rectangles, it is w / 2 from the outline whatever the rectangles' length. So a
strip makes what a mirror covers on its facets nearly what it covers on its sphere.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.shell.cell_outlines import (
    CellOutlines,
    cell_outlines,
    segment_counts,
    strip_points,
    strip_widths,
)
from tbcad.types import Bools, Floats, Ints

ROUNDS = 3  # the search is in a plane, so what it finds on a sphere is looked for again from there


def means(points: Floats, cell: Ints) -> Floats:
    """Mean of the points of each cell, (m, 3)."""
    counts = np.bincount(cell)[:, None]
    return np.column_stack([np.bincount(cell, weights=points[:, k]) for k in range(3)]) / counts


def middles(outlines: CellOutlines, mirrors: Surfaces) -> Floats:
    """Middle of each cell on its sphere, mm, (m, 3).

    It is that of the outline's points, or, where these do not all see it, the point that is
    farthest inside all lines along the outline: a cell may have a side that bends inward, at the
    foot. SpecError if no point of a cell sees its whole outline.
    """
    every, cell, edge = np.arange(len(mirrors)), outlines.cell, outlines.points
    middle = mirrors.projected(every, means(edge, cell))
    outside = -mirrors.gradient(cell, edge)
    inward = unit(np.cross(outside, edge[outlines.following] - edge))
    for _ in range(ROUNDS):
        hidden = np.unique(cell[dot(inward, middle[cell] - edge) <= 0])
        if not len(hidden):
            return middle
        normal = mirrors.gradient(hidden, middle[hidden])
        for k, axes in zip(hidden, perpendicular_axes(normal), strict=True):
            lines = edge[cell == k], inward[cell == k]
            middle[k] += _deepest_step(middle[k], axes, *lines)
        middle = mirrors.projected(every, middle)
    raise SpecError(
        f"a side of mirror a{hidden[0] + 1:04d} bends so far inward that no point of the mirror "
        "sees its whole outline: make optics.semi_minor_mm larger or increase optics.n"
    )


def _deepest_step(start: Floats, axes: Floats, point: Floats, inward: Floats) -> Floats:
    """Step (3,) in a plane to where the smallest distance inside all lines is largest."""
    # Unknowns: both steps and the smallest distance, which is to be largest.
    table = np.column_stack([-inward @ axes.T, np.ones(len(point))])
    solution = linprog([0, 0, -1], A_ub=table, b_ub=dot(inward, start - point), bounds=(None, None))
    step: Floats = np.asarray(solution.x)[:2] @ axes
    return step


@dataclass(frozen=True)
class Facets:
    """Vertices and triangles of all cells."""

    vertices: Floats  # mm, (v, 3); those of the outlines first
    triangles: Ints  # counter-clockwise seen from the light, (t, 3)
    mirror: Ints  # whose facet each is, (t,)
    outlines: CellOutlines  # of the cells


def mirror_facets(spec: Spec, cells: Cells, distance: Floats) -> Facets:
    """Facets of camera a's cells within the tolerances; distances (m,) to the object, mm."""
    outlines = cell_outlines(cells, segment_counts(spec, cells, distance))
    if np.all(cells.surfaces.curvature == 0):
        return _planar(outlines)
    return _spherical(spec, cells, outlines, distance)


def _planar(outlines: CellOutlines) -> Facets:
    """Fans about the cells' middles: any triangulation of a plane is exact."""
    middle = means(outlines.points, outlines.cell)
    hub = len(outlines.vertices) + outlines.cell
    fans = np.column_stack([outlines.vertex[outlines.following], outlines.vertex, hub])
    return Facets(np.concatenate([outlines.vertices, middle]), fans, outlines.cell, outlines)


def _spherical(spec: Spec, cells: Cells, outlines: CellOutlines, distance: Floats) -> Facets:
    """A strip along each outline, then rings of quads, then a fan about the middle."""
    mirrors, cell, edge = cells.mirror_surfaces, outlines.cell, outlines.points
    middle = middles(outlines, mirrors)
    farthest = np.zeros(len(mirrors))
    np.maximum.at(farthest, cell, norm(edge - middle[cell]))
    outside = -cells.surfaces.gradient(cell, edge)
    width = strip_widths(spec.mesh.ray_error_mm, mirrors.radius, distance, middle)
    strip = mirrors.projected(cell, strip_points(outlines, middle, outside, width))
    rings = np.ceil(farthest / np.sqrt(4 * spec.mesh.chord_error_mm * mirrors.radius))
    return _RingMesh(outlines, mirrors, middle, strip, rings.astype(np.int64)).facets()


@dataclass(frozen=True)
class _Ring:
    """One ring of vertices in each cell that has so many."""

    place: Ints  # in the outlines, of each place of the ring, (p,)
    vertex: Ints  # at each place, (p,)
    following: Ints  # next place of the same cell's ring, (p,)

    def inner(self, kept: Bools, vertex: Ints) -> "_Ring":
        """The next ring, in the cells kept."""
        renumbered = np.cumsum(kept) - 1
        return _Ring(self.place[kept], vertex, renumbered[self.following[kept]])


@dataclass(frozen=True)
class _RingMesh:
    """Rings of vertices from the outline of each cell to its middle."""

    outlines: CellOutlines  # the outer rings
    mirrors: Surfaces  # surfaces of the m cells
    middle: Floats  # middle point of each cell, (m, 3)
    strip: Floats  # points of the second ring, by place in the outlines, (b, 3)
    count: Ints  # rings inside the outline, the strip's included, at least 1, (m,)

    def facets(self) -> Facets:
        """Quads between the rings, and a fan about the middle."""
        outlines, cell = self.outlines, self.outlines.cell
        points = np.concatenate([outlines.vertices, self.middle])
        hub = len(outlines.vertices) + np.arange(len(self.middle))
        ring = _Ring(np.arange(len(cell)), outlines.vertex, outlines.following)
        triangles, mirror = [], []
        for k in range(int(self.count.max()) + 1):
            kept = self.count[cell[ring.place]] > k
            ended = cell[ring.place[~kept]]
            last = ring.vertex[ring.following[~kept]]
            triangles.append(np.column_stack([ring.vertex[~kept], last, hub[ended]]))
            inner_points = self._ring_points(k, ring.place[kept])
            inner = ring.inner(kept, len(points) + np.arange(len(inner_points)))
            points = np.concatenate([points, inner_points])
            triangles += self._quads(k, ring, kept, inner, points)
            mirror += [ended, cell[inner.place], cell[inner.place]]
            ring = inner
        # Collected counter-clockwise from outside; the solid's outside is the light's side.
        every = np.concatenate(triangles)[:, ::-1]
        return Facets(points, every, np.concatenate(mirror), outlines)

    def _ring_points(self, k: int, place: Ints) -> Floats:
        if k == 0:
            return self.strip[place]
        cell = self.outlines.cell[place]
        share = (1 - k / self.count[cell])[:, None]
        middle = self.middle[cell]
        return self.mirrors.projected(cell, middle + share * (self.strip[place] - middle))

    def _quads(self, k: int, outer: _Ring, kept: Bools, inner: _Ring, points: Floats) -> list[Ints]:
        """Two triangles for each quad; beyond the strip the shorter diagonal avoids obtuse angles.

        In the strip the right angle on the outline is at the segment's end, or its start at a
        corner.
        """
        a, b = outer.vertex[kept], outer.vertex[outer.following][kept]
        c, d = inner.vertex[inner.following], inner.vertex
        if k == 0:
            crossed = self.outlines.last_segment[inner.place]
        else:
            crossed = norm(points[b] - points[d]) < norm(points[a] - points[c])
        first = np.column_stack([a, b, np.where(crossed, d, c)])
        second = np.column_stack([np.where(crossed, b, a), c, d])
        return [first, second]
