"""Facets of the mirrors: rings of quads on each sphere, with a thin strip along the rim.

A facet reflects like a flat mirror whose normal is the sphere's at the facet's circumcentre. For
a right-angled triangle that is the middle of its longest side: in a strip of width w along the
rim, cut into rectangles, it is w / 2 from the rim whatever the rectangles' length. So a strip
makes what a mirror sees on its facets nearly what it sees on its sphere.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.design.spec import Mesh as MeshSpec
from tbcad.model.chains import Chain
from tbcad.optics.cells import Cells

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# A corner's inner point may lie this many strip widths away, where two arcs meet at a sharp angle.
LONGEST_MITRE = 4.0
# A narrower strip than sqrt(2 r q) gains nothing: the tilt q / w that rounding to 32-bit
# coordinates gives its facets is then more than w / (2 r).
STL_ROUNDING_MM = 2e-6
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


def facets(spec: MeshSpec, cells: Cells, distance: Floats) -> Facets:
    """Facets of all cells within the mesh tolerances.

    Args:
        spec: tolerances.
        cells: of the modelled surfaces.
        distance: from each mirror to the object, mm, (m,).
    """
    rim = _rim(spec, cells)
    if np.all(cells.surfaces.curvature == 0):
        return _planar(cells, rim)
    return _spherical(spec, cells, rim, distance)


@dataclass(frozen=True)
class _Rim:
    """Vertices on the arcs, and the closed line of vertices round each cell.

    Lines run counter-clockwise seen from outside, one cell after another.
    """

    vertices: Floats
    first: Ints
    steps: Ints
    start: Ints
    end: Ints
    cell: Ints  # of each vertex in the lines, (b,)
    line: Ints  # vertex, (b,)
    following: Ints  # place of the next vertex of the same line, (b,)
    late: NDArray[np.bool_]  # in the second half of its arc, (b,)


def _rim(spec: MeshSpec, cells: Cells) -> _Rim:
    arcs = cells.arcs
    steps = _steps(spec, cells)
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
    late = 2 * k >= steps[arc]
    return _Rim(vertices, first, steps, start, end, cell, line, _following(cell), late)


def _steps(spec: MeshSpec, cells: Cells) -> Ints:
    """Segments of each arc: with quads this long, facets keep the chord error."""
    arcs, curvature = cells.arcs, cells.surfaces.curvature[cells.arcs.faces].max(axis=1)
    longest = np.sqrt(4 * spec.chord_error_mm / np.where(curvature > 0, curvature, np.inf))
    with np.errstate(divide="ignore"):
        steps = np.ceil(arcs.length / np.where(curvature > 0, longest, np.inf))
    return np.where(curvature > 0, np.maximum(steps, 2), 1).astype(np.int64)


def _ragged(counts: Ints) -> tuple[Ints, Ints]:
    """Row and place in the row of every element of rows with these counts."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def _following(cell: Ints) -> Ints:
    place = np.arange(len(cell))
    begins = np.searchsorted(cell, cell, side="left")
    last = np.append(cell[1:] != cell[:-1], True)
    return np.where(last, begins, place + 1)


def _planar(cells: Cells, rim: _Rim) -> Facets:
    """Fans about the apices: any triangulation of a plane is exact."""
    count = len(rim.vertices)
    vertices = np.concatenate([rim.vertices, _means(rim.vertices[rim.line], rim.cell)])
    fan = np.column_stack([rim.line[rim.following], rim.line, count + rim.cell])
    return Facets(vertices, fan, rim.cell, rim.first, rim.steps, rim.start, rim.end)


def _means(points: Floats, cell: Ints) -> Floats:
    """Mean of the points of each cell, (m, 3)."""
    counts = np.bincount(cell)[:, None]
    return np.column_stack([np.bincount(cell, weights=points[:, k]) for k in range(3)]) / counts


def _spherical(spec: MeshSpec, cells: Cells, rim: _Rim, distance: Floats) -> Facets:
    surfaces = cells.surfaces
    radius, centre = surfaces.radius[: cells.mirrors], surfaces.centre[: cells.mirrors]

    def on_sphere(points: Floats, cell: Ints) -> Floats:
        away = points - centre[cell]
        away *= (radius[cell] / np.linalg.norm(away, axis=1))[:, None]
        return centre[cell] + away

    cell, edge = rim.cell, rim.vertices[rim.line]
    middle = on_sphere(_means(edge, cell), np.arange(cells.mirrors))
    reach = np.linalg.norm(edge - middle[cell], axis=1)
    nearest = np.full(cells.mirrors, np.inf)
    np.minimum.at(nearest, cell, reach)
    # The normal errs by (w / 2) / r, the reflected ray by twice that, over the distance.
    width = np.maximum(spec.ray_error_mm * radius / distance, np.sqrt(2 * radius * STL_ROUNDING_MM))
    width = np.minimum(width, WIDEST_STRIP * nearest)
    strip = on_sphere(_inside(edge, rim, surfaces.gradient(cell, edge), width[cell]), cell)

    ring_step = np.sqrt(4 * spec.chord_error_mm * radius)
    farthest = np.zeros(cells.mirrors)
    np.maximum.at(farthest, cell, reach)
    rings = np.maximum(np.ceil(farthest / ring_step), 1).astype(np.int64)

    vertices, triangles, mirror = [rim.vertices], [], []
    count, outer = len(rim.vertices), rim.line
    active = np.arange(len(cell))  # places whose ring is there
    following = rim.following
    for k in range(int(rings.max()) + 1):
        keep = rings[cell[active]] > k
        last = ~keep
        hub = count_of_hubs = cell[active[last]]
        del count_of_hubs
        triangles.append(np.column_stack([outer[last], outer[following[last]], -1 - hub]))
        mirror.append(hub)
        if not keep.any():
            break
        share = (1 - k / rings[cell[active[keep]]])[:, None]
        at = active[keep]
        points = middle[cell[at]] + share * (strip[at] - middle[cell[at]])
        points = strip[at] if k == 0 else on_sphere(points, cell[at])
        inner = count + np.arange(len(at))
        count += len(at)
        vertices.append(points)
        outer_here = outer[keep]
        renumber = np.cumsum(keep) - 1
        next_here = renumber[following[keep]]
        late = rim.late[at] if k == 0 else _crossed(np.concatenate(vertices), outer_here, inner, next_here)
        triangles += _quads(outer_here, inner, next_here, late)
        mirror += [cell[at], cell[at]]
        active, outer, following = at, inner, next_here
    every = np.concatenate(triangles)
    every = np.where(every < 0, count - 1 - every, every)
    vertices.append(middle)
    # Collected counter-clockwise from outside; the solid's outside is the light's side.
    return Facets(
        np.concatenate(vertices), every[:, ::-1], np.concatenate(mirror),
        rim.first, rim.steps, rim.start, rim.end,
    )


def _inside(edge: Floats, rim: _Rim, normal: Floats, width: Floats) -> Floats:
    """Points one strip width inside the rim, mitred where arcs meet."""
    ahead = edge[rim.following] - edge
    across = np.cross(-normal, ahead)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    before = np.empty_like(across)
    before[rim.following] = across
    scale = 1 + np.einsum("bx,bx->b", across, before)
    mitre = (across + before) / scale[:, None]
    long = np.linalg.norm(mitre, axis=1)
    mitre *= (np.minimum(long, LONGEST_MITRE) / long)[:, None]
    return edge + width[:, None] * mitre


def _crossed(points: Floats, outer: Ints, inner: Ints, following: Ints) -> NDArray[np.bool_]:
    """Where the diagonal from the next outer vertex to the inner one is the shorter."""
    one = points[outer[following]] - points[inner]
    other = points[inner[following]] - points[outer]
    result: NDArray[np.bool_] = np.linalg.norm(one, axis=1) < np.linalg.norm(other, axis=1)
    return result


def _quads(outer: Ints, inner: Ints, following: Ints, late: NDArray[np.bool_]) -> list[Ints]:
    """Two triangles for each quad; the one on the rim has its right angle away from corners."""
    a, b, c, d = outer, outer[following], inner[following], inner
    first = np.column_stack([a, b, np.where(late, d, c)])
    second = np.column_stack([np.where(late, b, a), c, d])
    return [first, second]
