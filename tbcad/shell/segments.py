"""Into how many segments each arc is cut, by what its facets do to rays."""

import numpy as np

from tbcad.mirrors.array import mirror_margins
from tbcad.optics.cells import Cells
from tbcad.optics.reflection import miss_distances
from tbcad.optics.windows import limiting_sides, minima_by_mirror
from tbcad.shell.cell_outlines import rows_and_columns
from tbcad.spec.design import Spec
from tbcad.types import Floats, Ints

MIN_SEGMENTS = 3
# Rays off the ends of a segment may cost its mirror this many ray errors of coverage's radius.
END_RAY_ERRORS = 2.0
# Start, middle and end of a segment.
PLACES = np.array([[0.0], [0.5], [1.0]])


def segment_counts(spec: Spec, cells: Cells, distance: Floats) -> Ints:
    """Segments of each arc (e,), for the mirror that needs more of the two.

    A first number follows from the rays' shift along the outline's image; where traced rays show
    that it is too small, segments are shortened.

    Args:
        spec: design with the mesh tolerances.
        cells: camera a's, of the modelled surfaces.
        distance: from each mirror to the object, mm, (m,).
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
    """By how much rays off the segments' ends miss more than they may: a factor for each arc, (e,).

    Light at an angle shifts across the outline's image too, most of all off long mirrors far from
    the camera. A facet's normal is the sphere's at the middle of its segment. What a mirror sees
    beyond the target is nothing that facets could cost.
    """
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
