"""Facets of the mirrors: rings of quads on each sphere, with a thin strip along the outline.

A facet reflects like a flat mirror whose normal is the sphere's at the facet's circumcentre. For
a right-angled triangle that is the middle of its longest side: in a strip of width w along the
outline, cut into rectangles, it is w / 2 from the outline whatever the rectangles' length. So a
strip makes what a mirror covers on its facets nearly what it covers on its sphere.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.cells import Cells
from tbcad.optics.surfaces import Surfaces
from tbcad.shell.cell_middles import means, middles
from tbcad.shell.cell_outlines import CellOutlines, cell_outlines, segment_counts
from tbcad.spec.design import Spec
from tbcad.types import Bools, Floats, Ints

# A corner's inner point is at most this many strip widths away, where arcs meet at a sharp angle.
MAX_MITRE = 4.0
# Share of the distance from outline to middle that the strip takes at most.
MAX_STRIP_SHARE = 0.1


@dataclass(frozen=True)
class Facets:
    """Vertices and triangles of all cells.

    Attributes:
        vertices: mm, (v, 3); those of the outlines first.
        triangles: counter-clockwise seen from the light, (t, 3).
        mirror: whose facet each is, (t,).
        outlines: of the cells.
    """

    vertices: Floats
    triangles: Ints
    mirror: Ints
    outlines: CellOutlines


def mirror_facets(spec: Spec, cells: Cells, distance: Floats) -> Facets:
    """Facets of all cells within the mesh tolerances.

    Args:
        spec: design with the mesh tolerances.
        cells: of the modelled surfaces.
        distance: from each mirror to the object, mm, (m,).
    """
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
    reach = norm(edge - middle[cell])
    first = np.unique(cell, return_index=True)[1]
    farthest, nearest = (limit.reduceat(reach, first) for limit in (np.maximum, np.minimum))
    width = np.minimum(
        _strip_width(spec.mesh.ray_error_mm, mirrors.radius, distance, middle),
        MAX_STRIP_SHARE * nearest,
    )
    outside = -cells.surfaces.gradient(cell, edge)
    strip = _strip_points(outlines, outside, width[cell])
    # Where the strip would fold it goes straight toward the middle instead, which never folds.
    folded = _folded_cells(outlines, strip, middle, outside)[cell]
    straight = edge + (width / farthest)[cell, None] * (middle[cell] - edge)
    strip = mirrors.projected(cell, np.where(folded[:, None], straight, strip))
    rings = np.ceil(farthest / np.sqrt(4 * spec.mesh.chord_error_mm * mirrors.radius))
    return _RingMesh(outlines, mirrors, middle, strip, rings.astype(np.int64)).facets()


def _strip_width(ray_error: float, radius: Floats, distance: Floats, points: Floats) -> Floats:
    """Width of the strip in each cell by the ray error, mm, (m,).

    The normal errs by (w / 2) / r, the reflected ray by twice that, over the distance. A strip
    narrower than sqrt(2 r q) gains nothing: the tilt q / w that a rounding error q gives its facets
    when points (m, 3) are written as 32-bit floats is then more than w / (2 r), the tilt of an
    exact strip.
    """
    largest = np.abs(points).max(axis=1).astype(np.float32)
    rounding = np.spacing(largest).astype(np.float64) / 2
    return np.asarray(np.maximum(ray_error * radius / distance, np.sqrt(2 * radius * rounding)))


@dataclass(frozen=True)
class _Ring:
    """One ring of vertices in each cell that has so many.

    Attributes:
        place: in the outlines, of each place of the ring, (p,).
        vertex: at each place, (p,).
        following: next place of the same cell's ring, (p,).
    """

    place: Ints
    vertex: Ints
    following: Ints

    def inner(self, kept: Bools, vertex: Ints) -> "_Ring":
        """The next ring, in the cells kept."""
        renumbered = np.cumsum(kept) - 1
        return _Ring(self.place[kept], vertex, renumbered[self.following[kept]])


@dataclass(frozen=True)
class _RingMesh:
    """Rings of vertices from the outline of each cell to its middle.

    Attributes:
        outlines: the outer rings.
        mirrors: surfaces of the m cells.
        middle: middle point of each cell, (m, 3).
        strip: points of the second ring, by place in the outlines, (b, 3).
        count: rings inside the outline, the strip's included, at least 1, (m,).
    """

    outlines: CellOutlines
    mirrors: Surfaces
    middle: Floats
    strip: Floats
    count: Ints

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
        """Two triangles for each quad.

        In the strip the one on the outline has its right angle at the end of its segment, or at
        the start where the end is a corner of the cell; further inside the shorter diagonal keeps
        angles from growing obtuse.
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


def _strip_points(outlines: CellOutlines, outside: Floats, width: Floats) -> Floats:
    """Points (b, 3) one strip width (b,) inside the outlines.

    Square to the segment before, so that its facet on the outline has a right angle there; where
    arcs meet, mitred. An arc has one such point less than segments: its last one, where rays
    are farthest from the object's centre, makes do with a skew.
    """
    edge = outlines.points
    across = unit(np.cross(outside, edge[outlines.following] - edge))
    before = np.empty_like(across)
    before[outlines.following] = across
    mitre = (across + before) / (1 + dot(across, before))[:, None]
    length = norm(mitre)
    mitre *= (np.minimum(length, MAX_MITRE) / length)[:, None]
    return edge + width[:, None] * np.where(outlines.corner[:, None], mitre, before)


def _folded_cells(outlines: CellOutlines, strip: Floats, middle: Floats, outside: Floats) -> Bools:
    """Cells (m,) whose strip would fold, as in a corner much sharper than 60 degrees."""
    edge, following = outlines.points, outlines.following
    a, b, c, d = edge, edge[following], strip[following], strip
    triangles = ((a, b, c), (a, c, d), (a, b, d), (b, c, d), (d, c, middle[outlines.cell]))
    wrong = [dot(np.cross(q - p, r - p), outside) <= 0 for p, q, r in triangles]
    folded: Bools = np.zeros(len(middle), dtype=bool)
    folded[outlines.cell[np.any(wrong, axis=0)]] = True
    return folded
