"""Facets of the mirrors: rings of quads on each sphere, with a thin strip along the rim.

A facet reflects like a flat mirror whose normal is the sphere's at the facet's circumcentre. For
a right-angled triangle that is the middle of its longest side: in a strip of width w along the
rim, cut into rectangles, it is w / 2 from the rim whatever the rectangles' length. So a strip
makes what a mirror sees on its facets nearly what it sees on its sphere.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.cells import Cells
from tbcad.shell.boundary import Chain
from tbcad.shell.rim import Rim, arc_vertices, segment_counts
from tbcad.spec.design import Spec
from tbcad.types import Floats, Ints

# A corner's inner point may lie this many strip widths away, where two arcs meet at a sharp angle.
LONGEST_MITRE = 4.0
# Share of the way from rim to centre that the strip may take at most.
WIDEST_STRIP = 0.1


@dataclass(frozen=True)
class Facets:
    """Vertices and triangles of all cells.

    Attributes:
        vertices: mm, (v, 3); corners first, then the arcs' inner points.
        triangles: counter-clockwise seen from the light, (t, 3).
        mirror: whose facet each is, (t,).
        first: first inner vertex of each arc, (e,).
        steps: segments of each arc, (e,).
        start: vertex at the start of each arc, (e,).
        end: vertex at its end, (e,).
    """

    vertices: Floats
    triangles: Ints
    mirror: Ints
    first: Ints
    steps: Ints
    start: Ints
    end: Ints

    def along(self, chain: Chain) -> Ints:
        """Vertices along a chain of arcs, its two ends included."""
        lines = [self._line(arc, forward) for arc, forward in chain]
        return np.concatenate([lines[0][:1], *(line[1:] for line in lines)])

    def _line(self, arc: int, forward: bool) -> Ints:
        inner = self.first[arc] + np.arange(self.steps[arc] - 1)
        line = np.concatenate([self.start[[arc]], inner, self.end[[arc]]])
        return line if forward else line[::-1]


def mirror_facets(spec: Spec, cells: Cells, distance: Floats) -> Facets:
    """Facets of all cells within the mesh tolerances.

    Args:
        spec: design with the mesh tolerances.
        cells: of the modelled surfaces.
        distance: from each mirror to the object, mm, (m,).
    """
    rim = arc_vertices(cells, segment_counts(spec, cells, distance))
    if np.all(cells.surfaces.curvature == 0):
        return _planar(cells, rim)
    return _spherical(spec, cells, rim, distance)


def _planar(cells: Cells, rim: Rim) -> Facets:
    """Fans about the apices: any triangulation of a plane is exact."""
    count = len(rim.vertices)
    vertices = np.concatenate([rim.vertices, _means(rim.vertices[rim.line], rim.cell)])
    fan = np.column_stack([rim.line[rim.following], rim.line, count + rim.cell])
    return Facets(vertices, fan, rim.cell, rim.first, rim.steps, rim.start, rim.end)


def _means(points: Floats, cell: Ints) -> Floats:
    """Mean of the points of each cell, (m, 3)."""
    counts = np.bincount(cell)[:, None]
    return np.column_stack([np.bincount(cell, weights=points[:, k]) for k in range(3)]) / counts


def _spherical(spec: Spec, cells: Cells, rim: Rim, distance: Floats) -> Facets:
    """A strip along each rim, then rings of quads, then a fan about the middle."""
    spheres = _Spheres(cells)
    cell, edge = rim.cell, rim.vertices[rim.line]
    middle = spheres.onto(_means(edge, cell), np.arange(cells.mirrors))
    reach = norm(edge - middle[cell])
    farthest = _per_cell(np.maximum, cell, reach)
    # The normal errs by (w / 2) / r, the reflected ray by twice that, over the distance.
    wanted = np.maximum(
        spec.mesh.ray_error_mm * spheres.radius / distance,
        np.sqrt(2 * spheres.radius * _rounding(middle)),
    )
    width = np.minimum(wanted, WIDEST_STRIP * _per_cell(np.minimum, cell, reach))
    outside = -cells.surfaces.gradient(cell, edge)
    inside = _inside(edge, rim, outside, width[cell])
    folded = _folded(edge, inside, middle[cell], rim, outside)
    # There the strip goes straight toward the middle instead, which never folds.
    straight = edge + (width / farthest)[cell, None] * (middle[cell] - edge)
    inside = np.where(folded[:, None], straight, inside)
    rings = np.ceil(farthest / np.sqrt(4 * spec.mesh.chord_error_mm * spheres.radius))
    build = _Rings(rim, spheres, middle, spheres.onto(inside, cell), rings.astype(np.int64))
    vertices, triangles, mirror = build.all()
    # Collected counter-clockwise from outside; the solid's outside is the light's side.
    return Facets(vertices, triangles[:, ::-1], mirror, rim.first, rim.steps, rim.start, rim.end)


def _rounding(points: Floats) -> Floats:
    """Rounding error of points (m, 3) written as 32-bit floats, mm, (m,).

    A strip narrower than sqrt(2 r q) gains nothing: the tilt q / w that a rounding error q gives
    its facets is then more than w / (2 r), the tilt of an exact strip.
    """
    largest = np.abs(points).max(axis=1).astype(np.float32)
    rounding: Floats = np.spacing(largest).astype(np.float64) / 2
    return rounding


def _per_cell(function: np.ufunc, cell: Ints, values: Floats) -> Floats:
    result: Floats = function.reduceat(values, np.unique(cell, return_index=True)[1])
    return result


class _Spheres:
    """Centres and radii of the mirrors."""

    def __init__(self, cells: Cells) -> None:
        self.radius = cells.surfaces.radius[: cells.mirrors]
        self.centre = cells.surfaces.centre[: cells.mirrors]

    def onto(self, points: Floats, cell: Ints) -> Floats:
        """Points (k, 3) moved onto the spheres of their cells (k,) along the radii."""
        away = points - self.centre[cell]
        away *= (self.radius[cell] / norm(away))[:, None]
        return self.centre[cell] + away


@dataclass(frozen=True)
class _Layer:
    """One ring of vertices in the cells that have so many: places in the lines, vertices."""

    place: Ints
    vertex: Ints
    following: Ints

    def part(self, keep: NDArray[np.bool_], vertex: Ints) -> "_Layer":
        """The next ring, in the cells kept."""
        renumbered = np.cumsum(keep) - 1
        return _Layer(self.place[keep], vertex, renumbered[self.following[keep]])


@dataclass(frozen=True)
class _Rings:
    """Rings from the rim of each cell to its middle.

    Attributes:
        rim: the outer rings.
        spheres: of the cells.
        middle: middle point of each cell, (m, 3).
        strip: the second rings' points, in the order of the lines, (b, 3).
        count: rings inside the rim, the strip's included, at least 1, (m,).
    """

    rim: Rim
    spheres: _Spheres
    middle: Floats
    strip: Floats
    count: Ints

    def all(self) -> tuple[Floats, Ints, Ints]:
        """Vertices (v, 3), triangles (t, 3) and the mirror of each (t,)."""
        rim, cell = self.rim, self.rim.cell
        points, triangles, mirror = [rim.vertices, self.middle], [], []
        hub = len(rim.vertices) + np.arange(len(self.middle))
        layer = _Layer(np.arange(len(cell)), rim.line, rim.following)
        total = len(rim.vertices) + len(self.middle)
        for k in range(int(self.count.max()) + 1):
            keep = self.count[cell[layer.place]] > k
            done = cell[layer.place[~keep]]
            last = np.column_stack([layer.vertex, layer.vertex[layer.following]])[~keep]
            triangles.append(np.column_stack([last, hub[done]]))
            mirror.append(done)
            points.append(self._ring(k, layer.place[keep]))
            inner = layer.part(keep, total + np.arange(len(points[-1])))
            total += len(points[-1])
            triangles += self._quads(k, layer, keep, inner, points)
            mirror += [cell[inner.place]] * 2
            layer = inner
        return np.concatenate(points), np.concatenate(triangles), np.concatenate(mirror)

    def _ring(self, k: int, place: Ints) -> Floats:
        if k == 0:
            return self.strip[place]
        cell = self.rim.cell[place]
        share = (1 - k / self.count[cell])[:, None]
        middle = self.middle[cell]
        return self.spheres.onto(middle + share * (self.strip[place] - middle), cell)

    def _quads(
        self, k: int, outer: _Layer, keep: NDArray[np.bool_], inner: _Layer, points: list[Floats]
    ) -> list[Ints]:
        """Two triangles for each quad.

        In the strip the one on the rim has its right angle at the end of its segment, or at the
        start where the end is a corner of the cell; further inside the shorter diagonal keeps
        angles from growing obtuse.
        """
        a, b = outer.vertex[keep], outer.vertex[outer.following][keep]
        c, d = inner.vertex[inner.following], inner.vertex
        if k == 0:
            crossed = self.rim.late[inner.place]
        else:
            every = np.concatenate(points)
            crossed = _length(every, b, d) < _length(every, a, c)
        first = np.column_stack([a, b, np.where(crossed, d, c)])
        second = np.column_stack([np.where(crossed, b, a), c, d])
        return [first, second]


def _length(points: Floats, a: Ints, b: Ints) -> Floats:
    return norm(points[a] - points[b])


def _inside(edge: Floats, rim: Rim, outside: Floats, width: Floats) -> Floats:
    """Points one strip width inside the rim.

    Square to the segment before, so that its facet on the rim has a right angle there; where
    arcs meet, mitred. An arc has one such point less than segments: its last one, where rays
    are farthest from the object's centre, makes do with a skew.
    """
    across = unit(np.cross(outside, edge[rim.following] - edge))
    before = np.empty_like(across)
    before[rim.following] = across
    mitre = (across + before) / (1 + dot(across, before))[:, None]
    long = norm(mitre)
    mitre *= (np.minimum(long, LONGEST_MITRE) / long)[:, None]
    return edge + width[:, None] * np.where(rim.corner[:, None], mitre, before)


def _folded(
    edge: Floats, inside: Floats, middle: Floats, rim: Rim, outside: Floats
) -> NDArray[np.bool_]:
    """Places (b,) of cells whose strip would fold, as in a corner much sharper than 60 degrees."""
    a, b, c, d = edge, edge[rim.following], inside[rim.following], inside
    every = ((a, b, c), (a, c, d), (a, b, d), (b, c, d), (d, c, middle))
    wrong = [dot(np.cross(q - p, r - p), outside) <= 0 for p, q, r in every]
    bad: NDArray[np.bool_] = np.zeros(rim.cell[-1] + 1, dtype=bool)
    bad[rim.cell[np.any(wrong, axis=0)]] = True
    return bad[rim.cell]
