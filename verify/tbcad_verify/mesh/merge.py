"""Merging of patches that creases cut out of one surface.

The facets of a sphere need not form a convex body: where the triangulation is poor, edges inside a
mirror look like valleys. The surface decides: the vertices of such a splinter lie on the surface of
its mirror.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.fits import PatchVertices, SurfaceFits, fit_surfaces, patch_vertices
from tbcad_verify.mesh.mesh import Mesh, connected_groups, sorted_unique
from tbcad_verify.mesh.segments import Edges, Segmentation
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import dot
from tbcad_verify.types import Floats, Ints

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
