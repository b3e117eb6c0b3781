"""Segmentation of a mesh along its creases into smooth patches; mirrors need not be known.

Inside a mirror, which bulges, every edge is convex by the little angle of its facets, or flat;
the valley between two mirrors is concave. A wall may meet a mirror at any convex angle; but it is
flat, and what is flat over many facets is no part of a sphere. What keeps "little" from "concave"
and from "flat" is only the rounding of the vertices to float32, and that is known: it can tilt a
facet by no more than its leverage over the facet's height.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mesh import Mesh, connected_groups, paired_half_edges
from tbcad_verify.mesh.vectors import chunks, cross, dot, norm, unit
from tbcad_verify.types import Bools, Floats

# A concave edge is a crease beyond this and the rounding, and so is the edge of a flat region. Flat
# mirrors at n = 60 meet at 0.003.
CONCAVE_RAD = 1e-3
# A convex one beyond this: facets of a mirror differ by 2 sqrt(2 chord error / radius), 0.1 at
# most for 0.01 mm on the smallest mirrors.
SHARP_RAD = 0.2
# Facets of a flat region, at least. On a sphere two facets may be flat together, as halves of a
# quad, but hardly more: corners that lie both on it and on a plane lie on one circle.
FLAT_FACETS = 6
# If rounding can change an edge's angle by more than this, it must not join two patches.
BLIND_RAD = 0.05
# Two facets that lie back to back, closer than this to a full turn: the surface is folded over.
FOLD_RAD = 0.2


@dataclass(frozen=True)
class Edges:
    """The edges between two facets, one a column."""

    half: NDArray[np.intp]  # (E,) one of the two half-edges, the one with the smaller number
    angle: Floats  # (E,) between the facets' normals, rad; positive where convex
    noise: Floats  # (E,) the most by which rounding can have changed the angle, rad


@dataclass(frozen=True)
class Segmentation:
    """Smooth patches."""

    label: NDArray[np.int32]  # (F,) segment of each facet
    count: int  # K


def measure_edges(mesh: Mesh) -> Edges:
    """Angle over every edge that has two facets, and how far rounding can have moved it."""
    half, _ = paired_half_edges(mesh)
    normal, double = unit(mesh.area), np.maximum(norm(mesh.area), np.finfo(np.float64).tiny)
    angle, tilt = np.empty((2, half.size))
    for part in chunks(half.size):
        angle[part], tilt[part] = _bend(mesh, normal, double, half[part])
    return Edges(half, angle, rounding(mesh) * tilt)


def _bend(
    mesh: Mesh, normal: Floats, double: Floats, half: NDArray[np.intp]
) -> tuple[Floats, Floats]:
    """Angles over edges, rad, and how far they tilt a unit of vertex error, rad/mm."""
    other = mesh.twin[half]
    start, edge = half_edge_vectors(mesh, half)
    length = norm(edge)
    n, m = np.take(normal, half // 3, axis=1), np.take(normal, other // 3, axis=1)
    angle = np.arctan2(dot(cross(n, m), edge) / length, dot(n, m))
    one, two = (
        _leverage(_corner(mesh, h, 2) - start, edge, length) * length / double[h // 3]
        for h in (half, other)
    )
    return angle, one + two


def rounding(mesh: Mesh) -> float:
    """How far float32 can have moved a vertex, mm: half a unit in the last place on each axis."""
    return math.sqrt(3) / 2 * float(np.spacing(np.float32(np.abs(mesh.points).max())))


def creases(mesh: Mesh, edges: Edges) -> Bools:
    """(E,) the edges that part two patches."""
    bent = np.abs(edges.angle) > CONCAVE_RAD + edges.noise
    sharp = edges.angle > SHARP_RAD + edges.noise
    blind = edges.noise > BLIND_RAD
    return np.asarray(bent & ((edges.angle < 0) | sharp | _beside_flat(mesh, edges)) | blind)


def _beside_flat(mesh: Mesh, edges: Edges) -> Bools:
    """(E,) whether a facet of an edge belongs to a flat region; edges inside one count too."""
    flat = edges.half[(np.abs(edges.angle) <= edges.noise) & (edges.noise <= BLIND_RAD)]
    count, region = connected_groups(len(mesh.faces), flat // 3, mesh.twin[flat] // 3)
    large = (np.bincount(region, minlength=count) >= FLAT_FACETS)[region]
    return np.asarray(large[edges.half // 3] | large[mesh.twin[edges.half] // 3])


def count_folds(edges: Edges, nearest: float = FOLD_RAD) -> int:
    """How many edges fold the surface back onto itself; a solid one can make has none.

    `nearest`: facets closer than this to a full turn lie back to back, rad.
    """
    turned = np.abs(edges.angle) - edges.noise > np.pi - nearest
    return int(turned.sum())


def total_bend(mesh: Mesh, edges: Edges) -> float:
    """Sum over edges of length times angle, as `MassProperties.bend` is, mm."""
    return float((norm(half_edge_vectors(mesh, edges.half)[1]) * np.abs(edges.angle)).sum())


def segment_mesh(mesh: Mesh, edges: Edges) -> Segmentation:
    """Join facets over all edges that are no creases."""
    smooth = edges.half[~creases(mesh, edges)]
    count, label = connected_groups(len(mesh.faces), smooth // 3, mesh.twin[smooth] // 3)
    return Segmentation(label, count)


def half_edge_vectors(mesh: Mesh, half: NDArray[np.integer]) -> tuple[Floats, Floats]:
    """Where half-edges start, (3, E) mm, and the vectors along them, (3, E) mm."""
    start = _corner(mesh, half, 0)
    return start, _corner(mesh, half, 1) - start


def _corner(mesh: Mesh, half: NDArray[np.integer], step: int) -> Floats:
    """(3, E) the corner where a half-edge starts, ends (step 1), or that faces it (step 2)."""
    facet, k = np.divmod(half, 3)
    return np.asarray(np.take(mesh.points, mesh.faces[facet, (k + step) % 3], axis=0).T)


def _leverage(apex: Floats, edge: Floats, length: Floats) -> Floats:
    # Beyond the edge's ends, its own vertices' errors are extrapolated.
    along = dot(apex, edge) / np.square(length)
    return np.asarray(1 + np.abs(along) + np.abs(1 - along))
