"""The mirrors in a mesh: it is cut into patches, splinters are merged, and each is judged.

The facets of a sphere need not form a convex body: where the triangulation is poor, edges inside a
mirror look like valleys. The surface decides: the vertices of a splinter lie on its mirror's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.fits import PatchVertices, SurfaceFits, fit_surfaces, patch_vertices
from tbcad_verify.mesh.holes import round_holes
from tbcad_verify.mesh.mesh import Mesh, connected_groups, sorted_unique
from tbcad_verify.mesh.segments import Edges, Segmentation, count_folds, measure_edges, segment_mesh
from tbcad_verify.mesh.surfaces import Surfaces, reflect_directions
from tbcad_verify.mesh.vectors import dot, joined, norm
from tbcad_verify.types import Bools, Floats, Ints

# A patch is a mirror's only if its vertices lie on one sphere or plane to within this, RMS.
FORM_MM = 1e-3
# And only if its facets, which are flat, follow the surface to within this, or to within this
# share of its bulge: vertices alone may fit by chance, as those of a cone or a bore do, whose few
# circles lie on a sphere.
CHORD_MM, CHORD_SHARE = 0.1, 0.05
# What bulges less than this over its extent is a plane: ten times what float32 rounding does.
FLAT_MM = 1e-4
# Minimum cosine of incidence on a mirror.
GRAZING = 0.05
Pairs = tuple[Ints, Ints]

# A splinter belongs to a surface if it lies on it to within this, everywhere.
SAME_MM = 2e-4
# And if their normals agree, by the cosine of the angle. All corners of a wall's splinter may lie
# on a mirror's edge, but its normal is another.
ALONG = 0.9
# The normal of what is thinner than this is not known.
THIN_MM = 1e-3
# No edge inside a mirror is sharper than this.
EDGE_RAD = 1.0
# Vertices of a patch whose surface is known: twice a sphere's four unknowns.
MIN_VERTICES = 8
# Vertices of a splinter that are tried before all.
FIRST_TRIED = 6
ROUNDS = 8


@dataclass(frozen=True)
class Recovery:
    """The patches of one or more meshes."""

    segments: Segmentation  # patch of every facet
    fits: SurfaceFits  # surface of every patch
    mirror: Bools  # (K,) true for those that are mirrors
    folds: int  # edges at which the mesh is folded onto itself


def recover(
    mesh: Mesh, pinhole: Floats | None, radius_mm: float, edges: Edges | None = None
) -> Recovery:
    """Find the mirrors of one part, from triangles alone.

    A mirror is a patch of a bulging sphere, or of a plane that sends the camera's light into the
    capture sphere and is no strip of a round hole's wall; it faces both the camera and the object.

    `pinhole`: (3,) mm; None for parts that have no mirrors.
    `edges`: of the mesh, if they are measured.
    """
    edges = edges or measure_edges(mesh)
    segments, fits = merge_splinters(mesh, edges, segment_mesh(mesh, edges))
    mirror = _judge(fits, pinhole, radius_mm)
    if (mirror & _planes(fits)).any():
        mirror &= ~_hole_walls(mesh, edges, segments)
    return Recovery(segments, fits, mirror, count_folds(edges))


def join_recoveries(parts: list[Recovery]) -> Recovery:
    """Several parts' patches, numbered on."""
    starts = np.cumsum([0, *(part.segments.count for part in parts)])
    label = np.concatenate(
        [part.segments.label + start for part, start in zip(parts, starts, strict=False)]
    )
    return Recovery(
        Segmentation(label.astype(np.int32), int(starts[-1])),
        joined([part.fits for part in parts]),
        np.concatenate([part.mirror for part in parts]),
        sum(part.folds for part in parts),
    )


def follows_fit(fits: SurfaceFits) -> Bools:
    """(K,) true where the fitted surface is what the patch really is."""
    followed = fits.chord < np.maximum(CHORD_MM, CHORD_SHARE * np.abs(fits.sag))
    return np.asarray((fits.form < FORM_MM) & followed)


def _judge(fits: SurfaceFits, pinhole: Floats | None, radius_mm: float) -> Bools:
    if pinhole is None:
        return np.zeros(fits.form.size, dtype=np.bool_)
    middle, normal = fits.middle, fits.normal
    incoming = middle - pinhole[:, None]
    facing = [-dot(d, normal) > GRAZING * norm(d) for d in (incoming, middle)]
    outgoing = reflect_directions(incoming, normal)
    along = dot(middle, outgoing) / dot(outgoing, outgoing)
    # Some of its light lands: what leaves the middle may miss by the patch's own image.
    image = fits.extent * (1 + norm(middle) / norm(incoming))
    lands = norm(middle - along * outgoing) <= radius_mm + image
    bulges = (fits.sag > FLAT_MM) & (fits.count >= MIN_VERTICES)
    is_mirror = bulges | (_planes(fits) & lands)
    return np.asarray(follows_fit(fits) & facing[0] & facing[1] & is_mirror)


def _planes(fits: SurfaceFits) -> Bools:
    return np.asarray(np.abs(fits.sag) <= FLAT_MM)


def _hole_walls(mesh: Mesh, edges: Edges, segments: Segmentation) -> Bools:
    """(K,) the patches in walls of round holes: each facet of a coarse cylinder is a plane."""
    walls = np.zeros(segments.count, dtype=np.bool_)
    walls[segments.label[round_holes(mesh, edges).wall]] = True
    return walls


def merge_splinters(
    mesh: Mesh, edges: Edges, segments: Segmentation
) -> tuple[Segmentation, SurfaceFits]:
    """Join splinters to the best known surface next to them, until nothing changes.

    Returns:
        The patches, and the surfaces fitted to them.
    """
    for _ in range(ROUNDS):
        points = patch_vertices(mesh, segments)
        fits = fit_surfaces(mesh, segments, points)
        small, large = _joints(mesh, edges, segments, points, fits)
        if not small.size:
            break
        count, label = connected_groups(segments.count, small, large)
        segments = Segmentation(label[segments.label], count)
    else:
        fits = fit_surfaces(mesh, segments, patch_vertices(mesh, segments))
    return segments, fits


def _joints(
    mesh: Mesh, edges: Edges, segments: Segmentation, points: PatchVertices, fits: SurfaceFits
) -> Pairs:
    """Splinters and what each belongs to: one neighbour, for none must bridge two mirrors."""
    small, large = _neighbours(mesh, edges, segments, fits.area)
    likely = (fits.count[large] >= MIN_VERTICES) & _along(fits, small, large)
    small, large = small[likely], large[likely]
    likely = _farthest(mesh, points, fits.surfaces, (small, large), FIRST_TRIED) < SAME_MM
    small, large = small[likely], large[likely]
    worst = _farthest(mesh, points, fits.surfaces, (small, large))
    order = np.lexsort((worst, small))
    best = order[np.unique(small[order], return_index=True)[1]]
    best = best[worst[best] < SAME_MM]
    return small[best], large[best]


def _neighbours(mesh: Mesh, edges: Edges, segments: Segmentation, area: Floats) -> Pairs:
    """Pairs of patches with a common edge that is not too sharp, the one of smaller area first."""
    blunt = np.abs(edges.angle) <= EDGE_RAD + edges.noise
    half = edges.half[blunt]
    one, two = segments.label[half // 3], segments.label[mesh.twin[half] // 3]
    one, two = one[one != two], two[one != two]
    rank = np.empty(segments.count, dtype=np.int64)
    rank[np.argsort(area, kind="stable")] = np.arange(segments.count)
    small = np.where(rank[one] < rank[two], one, two).astype(np.int64)
    keys = sorted_unique(small * segments.count + (one + two - small))
    return keys // segments.count, keys % segments.count


def _along(fits: SurfaceFits, small: Ints, large: Ints) -> NDArray[np.bool_]:
    surface = fits.surfaces.take(large).gradient(fits.middle[:, small])
    thin = fits.area[small] < THIN_MM * fits.extent[small]
    return np.asarray(thin | (dot(surface, fits.normal[:, small]) > ALONG))


def _farthest(
    mesh: Mesh, points: PatchVertices, surfaces: Surfaces, pairs: Pairs, most: int = 1 << 62
) -> Floats:
    """Largest distance of (the most first of) a patch's vertices from its neighbour's surface."""
    small, large = pairs
    if not small.size:
        return np.zeros(0)
    size = np.minimum(np.diff(np.append(points.first, points.segment.size))[small], most)
    starts = np.cumsum(size) - size
    rows = np.arange(size.sum()) + np.repeat(points.first[small] - starts, size)
    height = surfaces.take(np.repeat(large, size)).height(mesh.points[points.vertex[rows]].T)
    return np.asarray(np.maximum.reduceat(np.abs(height), starts))
