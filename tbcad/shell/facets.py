"""Facets of the mirrors: rings of quads on each sphere, with a thin strip along the outline.

A facet reflects like a flat mirror whose normal is the sphere's at the facet's circumcentre. For
a right-angled triangle that is the middle of its longest side: in a strip of width w along the
outline, cut into rectangles, it is w / 2 from the outline whatever the rectangles' length. So a
strip makes what a mirror covers on its facets nearly what it covers on its sphere.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog

from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.shell.cell_outlines import (
    CellOutlines,
    cell_outlines,
    rows_and_columns,
    segment_counts,
    strip_points,
    strip_widths,
)
from tbcad.types import Floats, Ints

ROUNDS = 3  # the search is in a plane, so what it finds on a sphere is looked for again from there
# Cosine of the angle between a facet and its sphere: 0.96 in the worst cells that can be built,
# 0.02 where slivers stand up and fold.
MIN_ALONG_SPHERE = 0.5
MARGINS_PER_MM = 10  # steps of a margin that an error names
NEWTON = 5  # steps from a corner or edge to where coats meet


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
    raise _bent_inward(int(hidden[0]), "no point of the mirror sees its whole outline")


def _bent_inward(mirror: int, effect: str) -> SpecError:
    return SpecError(
        f"a side of mirror a{mirror + 1:04d} bends so far inward that {effect}: make "
        "optics.semi_minor_mm larger or increase optics.n"
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


def mirror_facets(spec: Spec, cells: Cells, distance: Floats, *, outermost: bool = False) -> Facets:
    """Facets of camera a's cells within the tolerances; distances (m,) to the object, mm.

    `outermost`: those along the outlines alone, and one fan within them, in a tenth of the time.
    """
    outlines = cell_outlines(cells, segment_counts(spec, cells, distance))
    if np.all(cells.surfaces.curvature == 0):
        return _planar(outlines)
    return _spherical(spec, cells, outlines, distance, outermost)


def check_facets(spec: Spec, cells: Cells, distance: Floats) -> None:
    """SpecError where facets would fold, or show too little; arguments as of `mirror_facets`.

    Both are worst along the outlines, so nothing else is asked.
    """
    facets = mirror_facets(spec, cells, distance, outermost=True)
    if np.any(cells.surfaces.curvature > 0):
        strips = slice(2 * len(facets.outlines.cell))  # the fans' facets are in no file
        along = replace(facets, triangles=facets.triangles[strips], mirror=facets.mirror[strips])
        check_folds(along, cells.mirror_surfaces)
    check_coverage(spec, cells, facets)


def facet_coverage(spec: Spec, cells: Cells, facets: Facets) -> float:
    """Coverage diameter that facets show, mm, as 32-bit floats hold them.

    They cost most along the outline: of the facets there rays off both ends count, where a coat
    brings these.
    """
    outlines, pinhole = facets.outlines, np.array(spec.optics.camera_mm)
    _, sides = cells.rings
    arc = sides[rows_and_columns(outlines.segments[sides // 2])[0]] // 2
    beyond = cells.arcs.faces[arc].sum(axis=1) - outlines.cell
    cut = (beyond == cells.seam) & cells.halved[outlines.cell]
    written = facets.vertices.astype(np.float32).astype(np.float64)
    beside = written[facets.triangles[: len(arc)]][~cut]
    a, b, c = beside.swapaxes(0, 1)
    normal = unit(np.cross(b - a, c - a))
    ends = written[np.stack([outlines.vertex, outlines.vertex[outlines.following]])][:, ~cut]
    if coat := spec.mirrors.coating_um / 1000:
        ends = _onto_coats(cells, coat, (outlines.cell[~cut], beyond[~cut]), ends)
    return 2 * float(miss_distances(pinhole, ends, normal).min())


def _onto_coats(cells: Cells, coat: float, faces: tuple[Ints, Ints], points: Floats) -> Floats:
    """Ends (2, b, 3) of facets moved by a coat (mm) to where it meets the face beyond.

    Of the faces only mirrors have a coat.
    """
    own, beyond = faces
    bare = cells.surfaces.subset(slice(cells.mirrors, None))
    coated = cells.mirror_surfaces.offset(coat).joined(bare)
    for _ in range(NEWTON):
        f, g = coated.value(own, points), coated.value(beyond, points)
        up, across = coated.gradient(own, points), coated.gradient(beyond, points)
        along = dot(up, across)
        # The shortest step onto both surfaces is in the plane of their normals.
        a, b = np.stack([f - along * g, g - along * f])[..., None] / (1 - along**2)[..., None]
        points = points - a * up - b * across
    return points


def check_coverage(spec: Spec, cells: Cells, facets: Facets) -> None:
    """SpecError where facets of mirrors by rule traced show less than the capture sphere."""
    if spec.mirrors.radius_rule != "traced":
        return
    wanted, margin = spec.optics.capture_diameter_mm, spec.mirrors.margin_mm
    shown = facet_coverage(spec, cells, facets)
    if shown < wanted:
        enough = math.ceil((margin + wanted - shown) * MARGINS_PER_MM) / MARGINS_PER_MM
        raise SpecError(
            f"facets of the mirrors show {shown:.2f} mm, less than optics.capture_diameter_mm "
            f"{wanted:g}: make mirrors.margin_mm {enough:g} instead of {margin:g}, or "
            "mesh.ray_error_mm smaller"
        )


def _planar(outlines: CellOutlines) -> Facets:
    """Fans about the cells' middles: any triangulation of a plane is exact."""
    middle = means(outlines.points, outlines.cell)
    hub = len(outlines.vertices) + outlines.cell
    fans = np.column_stack([outlines.vertex[outlines.following], outlines.vertex, hub])
    return Facets(np.concatenate([outlines.vertices, middle]), fans, outlines.cell, outlines)


def _spherical(
    spec: Spec, cells: Cells, outlines: CellOutlines, distance: Floats, outermost: bool
) -> Facets:
    """A strip along each outline, then rings of quads, then a fan about the middle."""
    mirrors, cell, edge = cells.mirror_surfaces, outlines.cell, outlines.points
    middle = middles(outlines, mirrors)
    farthest = np.zeros(len(mirrors))
    np.maximum.at(farthest, cell, norm(edge - middle[cell]))
    outside = -cells.surfaces.gradient(cell, edge)
    width = strip_widths(spec.mesh.ray_error_mm, mirrors.radius, distance, middle)
    strip = mirrors.projected(cell, strip_points(outlines, middle, outside, width))
    rings = np.ceil(farthest / np.sqrt(4 * spec.mesh.chord_error_mm * mirrors.radius))
    rings = np.minimum(rings, 1) if outermost else rings
    return _ringed(outlines, mirrors, middle, strip, rings.astype(np.int64))


def check_folds(facets: Facets, mirrors: Surfaces) -> None:
    """SpecError where a facet stands up from its sphere, and so folds the surface."""
    a, b, c = facets.vertices[facets.triangles.T]
    square = np.cross(b - a, c - a)
    along = dot(square, mirrors.gradient(facets.mirror, a)) - MIN_ALONG_SPHERE * norm(square)
    worst = int(along.argmin())
    if along[worst] >= 0:
        return
    longest = max(norm(side[worst]) for side in (b - a, c - b, a - c))
    raise _bent_inward(
        int(facets.mirror[worst]),
        f"its facets would fold: one {longest:.2g} mm long is {norm(square[worst]) / longest:.2g} "
        "mm wide",
    )


def _ringed(
    outlines: CellOutlines, mirrors: Surfaces, middle: Floats, strip: Floats, count: Ints
) -> Facets:
    """Quads between rings of vertices from the outline of each cell, then a fan about its middle.

    Cells have counts (m,) of rings inside the outline, at least 1: the first through points of the
    strip (b, 3), by place in the outlines.
    """
    cell = outlines.cell
    points = np.concatenate([outlines.vertices, middle])
    hub = len(outlines.vertices) + np.arange(len(middle))
    # Of a ring: places in the outlines, vertex at each place, next place of the same cell's ring.
    place, vertex, following = np.arange(len(cell)), outlines.vertex, outlines.following
    triangles, mirror = [], []
    for k in range(int(count.max()) + 1):
        kept = count[cell[place]] > k
        ended = cell[place[~kept]]
        triangles.append(np.column_stack([vertex[~kept], vertex[following[~kept]], hub[ended]]))
        a, b = vertex[kept], vertex[following[kept]]
        place, following = place[kept], (np.cumsum(kept) - 1)[following[kept]]
        own, inner = cell[place], strip[place]
        if k > 0:
            share = (1 - k / count[own])[:, None]
            inner = mirrors.projected(own, middle[own] + share * (inner - middle[own]))
        vertex = len(points) + np.arange(len(place))
        points = np.concatenate([points, inner])
        c, d = vertex[following], vertex
        # In the strip the right angle on the outline is at the segment's end, or its start at a
        # corner; beyond it the shorter diagonal avoids obtuse angles.
        crossed = outlines.last_segment[place]
        if k > 0:
            crossed = norm(points[b] - points[d]) < norm(points[a] - points[c])
        triangles.append(np.column_stack([a, b, np.where(crossed, d, c)]))
        triangles.append(np.column_stack([np.where(crossed, b, a), c, d]))
        mirror += [ended, own, own]
    # Collected counter-clockwise from outside; the solid's outside is the light's side.
    return Facets(points, np.concatenate(triangles)[:, ::-1], np.concatenate(mirror), outlines)
