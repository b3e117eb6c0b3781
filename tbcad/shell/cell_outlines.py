"""Vertices on the arcs, the closed outline of them round each cell, and strips along it.

Arcs are cut into so many segments as what their facets do to rays demands.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import mirror_margins
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.optics.windows import limiting_sides, minima_by_mirror
from tbcad.core.spec.design import Spec
from tbcad.types import Bools, Floats, Ints

MAX_MITRE = 4.0  # strip widths that a corner's inner point is away at most, at sharp angles
MAX_STRIP_SHARE = 0.1  # share of the distance from outline to middle that the strip takes at most
MIN_INNER_SHARE = 0.5  # of a segment, of its inner side: mitres may be longer than a short segment
MIN_SEGMENTS = 3
END_RAY_ERRORS = 2.0  # that rays off a segment's ends may cost its mirror of coverage's radius
PLACES = np.array([[0.0], [0.5], [1.0]])  # start, middle and end of a segment


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
    last = np.append(cell[1:] != cell[:-1], True)  # place of its outline
    return CellOutlines(
        vertices,
        first_inner,
        segments,
        start,
        end,
        cell,
        vertex,
        following=np.where(last, np.searchsorted(cell, cell), np.arange(len(cell)) + 1),
        corner=k == 0,
        last_segment=k == segments[arc] - 1,
    )


def rows_and_columns(counts: Ints) -> tuple[Ints, Ints]:
    """Row and column of every element of rows with these many elements each."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def strip_widths(ray_error: float, radius: Floats, distance: Floats, points: Floats) -> Floats:
    """Width of the strip in each cell by the ray error, mm, (m,).

    The normal errs by (w / 2) / r, the reflected ray by twice that, over the distance. A strip
    narrower than sqrt(2 r q) gains nothing: the tilt q / w that a rounding error q gives its facets
    when points (m, 3) are written as 32-bit floats is then more than w / (2 r), the tilt of an
    exact strip.
    """
    largest = np.abs(points).max(axis=1).astype(np.float32)
    rounding = np.spacing(largest).astype(np.float64) / 2
    return np.asarray(np.maximum(ray_error * radius / distance, np.sqrt(2 * radius * rounding)))


def strip_points(
    outlines: CellOutlines, middle: Floats, outside: Floats, cell_width: Floats
) -> Floats:
    """Points (b, 3), one for each place of the outlines, on the strips' inner sides.

    They are square to the outline, but for places about segments so short that the strip would fold
    there: these have points toward the cell's middle (m, 3), which never fold. Such points skew the
    facets on their outline, which costs rays their aim on long segments and not on short ones. Unit
    normals outside (b, 3) are away from the light; strips have a width in each cell, mm, (m,).
    """
    cell, edge = outlines.cell, outlines.points
    to_middle = middle[cell] - edge
    distance, first = norm(to_middle), np.unique(cell, return_index=True)[1]
    nearest, farthest = (by.reduceat(distance, first) for by in (np.minimum, np.maximum))
    width = np.minimum(cell_width, MAX_STRIP_SHARE * nearest)
    strip = edge + width[cell, None] * _inward(outlines, outside)
    straight = edge + (width / farthest)[cell, None] * to_middle
    leaning = np.zeros(len(edge), dtype=bool)
    while np.any(added := ~leaning & _cramped(outlines, strip, middle, outside)):
        leaning |= added
        strip = np.where(leaning[:, None], straight, strip)
    return strip


def _inward(outlines: CellOutlines, outside: Floats) -> Floats:
    """Vectors (b, 3) from the outlines to their strips' inner sides, for a width of one.

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
    return np.where(outlines.corner[:, None], mitre, before)


def _cramped(outlines: CellOutlines, strip: Floats, middle: Floats, outside: Floats) -> Bools:
    """Places (b,) at the ends of segments where the strip folds or its inner side is too short."""
    edge, following = outlines.points, outlines.following
    a, b, c, d = edge, edge[following], strip[following], strip
    triangles = ((a, b, c), (a, c, d), (a, b, d), (b, c, d), (d, c, middle[outlines.cell]))
    folds = [dot(np.cross(q - p, r - p), outside) <= 0 for p, q, r in triangles]
    short = dot(c - d, b - a) < MIN_INNER_SHARE * dot(b - a, b - a)
    at_start = np.any([*folds, short], axis=0)
    at_end = np.zeros_like(at_start)
    at_end[following] = at_start
    return np.asarray(at_start | at_end)


def segment_counts(spec: Spec, cells: Cells, distance: Floats) -> Ints:
    """Segments of each arc (e,), for the mirror that needs more; distances to the object (m,), mm.

    A first number follows from the rays' shift along the outline's image; where traced rays show
    that it is too small, segments are shortened.
    """
    counts = _by_shift(spec, cells, distance)
    # A ray's error at a segment's end is proportional to the segment's length.
    return np.ceil(counts * np.maximum(_excess(spec, cells, counts), 1)).astype(np.int64)


def _by_shift(spec: Spec, cells: Cells, distance: Floats) -> Ints:
    """Segments of each arc (e,) by distances alone.

    A facet keeps one normal along its segment of length s, so the rays at its ends shift by
    s (distance / r) along the outline's image. Near where that image comes closest to the object's
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
    segments = np.ceil(arcs.length / longest[arcs.faces].min(axis=1))
    straight = arcs.weight == 1
    return np.where(straight, 1, np.maximum(segments, MIN_SEGMENTS)).astype(np.int64)


def _excess(spec: Spec, cells: Cells, counts: Ints) -> Floats:
    """By how much more than they may rays off the segments' ends miss: factors of arcs, (e,)."""
    mirror, arc = limiting_sides(cells)
    side, k = rows_and_columns(counts[arc])
    mirror, arc = mirror[side], arc[side]
    t = (k + PLACES) / counts[arc]
    of_mirror = np.broadcast_to(mirror, t.shape)
    points = cells.arcs.at(np.broadcast_to(arc, t.shape), t)
    normals = cells.surfaces.gradient(of_mirror, points)
    pinhole = np.array(spec.optics.camera_mm)
    exact = miss_distances(pinhole, points, normals).min(axis=0)
    off_facets = miss_distances(pinhole, points[[0, 2]], normals[1]).min(axis=0)
    target = spec.optics.capture_diameter_mm + mirror_margins(spec.mirrors, cells.mirrors)
    seen = np.minimum(minima_by_mirror(mirror, exact, cells.mirrors), target / 2)
    excess = np.zeros(len(counts))
    np.maximum.at(
        excess, arc, (seen[mirror] - off_facets) / (END_RAY_ERRORS * spec.mesh.ray_error_mm)
    )
    return excess
