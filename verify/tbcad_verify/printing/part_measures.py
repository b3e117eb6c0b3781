"""Everything about one part's mesh that does not depend on a printer, measured once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh import rays
from tbcad_verify.mesh.holes import RoundHoles, round_holes
from tbcad_verify.mesh.mesh import (
    MassProperties,
    Mesh,
    connected_groups,
    facet_volumes,
    longest_sides,
    paired_half_edges,
)
from tbcad_verify.mesh.rays import RayScene, distances_to_planes, first_hits, in_threads
from tbcad_verify.mesh.segments import Edges, half_edge_vectors, measure_edges, rounding
from tbcad_verify.mesh.vectors import chunks, dot, norm, unit
from tbcad_verify.printing.orientations import PartHull, part_hull
from tbcad_verify.types import Bools, Floats, Ints

# Maximum angle between a ray and the outward normal where it leaves. Where a wall between smooth
# sides is thinnest, they are parallel, or the thickness would decrease to one side. Facets of a
# round hole of eight sides are off by 22.5 degrees at most. Beyond 30 the sides meet in an edge,
# where thickness tends to zero anyway; an edge sharper than 30 degrees is a wall that tapers off.
SQUARE_COS = math.cos(math.radians(30))
# A ray from the bottom of a groove bisects its sides and meets a groove of 90 degrees on the other
# side at 45. No edge is near, so thickness does not tend to zero there.
GROOVE_COS = math.cos(math.radians(50))
GROOVE_RAD = 0.1  # a concave edge beyond this is the bottom of a groove
# A groove of less than 30 degrees is a slit that prints fill at its bottom, for 0.4 mm have no room
# in the lowest 0.75 mm: what is left below is thicker than a ray from where the sides meet finds.
SLIT_RAD = math.pi - math.radians(30)
# Facets whose normal rounding may have tilted more than this are neither start nor end of a ray:
# a ray from a tilted sliver hits the sliver's own neighbours.
SOUND_RAD = 0.05
STEP = 0.01  # of the box's diagonal: facets longer than this are measured in several places
INSET = 0.01  # how far samples keep from a facet's rim, of its size
LATTICES = (16, 8, 4, 2, 1)  # maximum steps along a side of a facet: the first within MAX_RAYS
MAX_RAYS = 1_500_000  # beyond one a facet
LIFT_ULP = 8  # of float32, by which rays start below the surface


@dataclass(frozen=True)
class InnerEdges:
    """Inner edges, where the air between two faces fills less than a half turn."""

    bend: Floats  # (E,) rad between the faces' normals
    length: Floats  # (E,) mm


@dataclass(frozen=True)
class PartMeasures:
    """One part."""

    mesh: Mesh  # its triangles
    status: str  # of manifold3d; "NoError" is good
    mass: MassProperties  # volume, area, centroid, box
    solids: int  # connected surfaces that enclose material; more than one means loose shells
    cavities: int  # connected surfaces that enclose a void: turned inside out
    walls: WallThickness  # thickness
    holes: RoundHoles  # round ones
    inner_edges: InnerEdges  # between concave faces
    hull: PartHull  # convex hull, and the orientations to try

    @property
    def triangles(self) -> int:
        """Their number."""
        return len(self.mesh.faces)


def measure(
    mesh: Mesh,
    status: str,
    mass: MassProperties,
    edges: Edges | None = None,
    scene: rays.RayScene | None = None,
) -> PartMeasures:
    """Measure a mesh.

    `mesh`: a part's; figures of one that is not closed mean little, as its `status` says.
    `edges`: of the mesh, if they are measured.
    `scene`: of the mesh, if there is one.

    Unknown: all points lie in a plane: there is nothing to measure.
    """
    hull = part_hull(mesh.points)
    # Facets without area have edges without an angle; those are uncertain, and left out.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        edges = edges or measure_edges(mesh)
    return PartMeasures(
        mesh,
        status,
        mass,
        *_solids_and_cavities(mesh),
        wall_thickness(mesh, edges, scene or rays.build_scene(mesh)),
        round_holes(mesh, edges),
        _inner_edges(mesh, edges),
        hull,
    )


def _solids_and_cavities(mesh: Mesh) -> tuple[int, int]:
    first, second = paired_half_edges(mesh)
    count, label = connected_groups(len(mesh.faces), first // 3, second // 3)
    inside_out = int((np.bincount(label, facet_volumes(mesh), count) < 0).sum())
    return count - inside_out, inside_out


def _inner_edges(mesh: Mesh, edges: Edges) -> InnerEdges:
    inner = edges.angle < -edges.noise
    vectors = half_edge_vectors(mesh, edges.half[inner])[1]
    return InnerEdges(-edges.angle[inner], norm(vectors))


@dataclass(frozen=True)
class WallThickness:
    """Thickness at S samples."""

    thickness: Floats  # (S,) mm; infinite where no opposite side faces the ray
    share: Floats  # (S,) mm^2 of surface that a sample represents; 0 in grooves
    minimum: float  # mm; infinite if there is no wall at all
    where: Floats  # (3,) middle of the thinnest wall, mm


@dataclass(frozen=True)
class ThicknessRays:
    """Start points and directions of S rays."""

    start: Floats  # (3, S) on the surface, mm
    inward: Floats  # (3, S) unit
    share: Floats  # (S,) mm^2
    min_cosine: float  # between the ray and the outward normal that it meets


def wall_thickness(mesh: Mesh, edges: Edges, scene: RayScene) -> WallThickness:
    """Measure thickness from every facet, and from the bottom of every groove."""
    longest = longest_sides(mesh)
    # Twice the area over the longest side is the smallest height; both ends of it are rounded.
    sound = norm(mesh.area) * SOUND_RAD > 2 * rounding(mesh) * longest
    step = STEP * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    probes = [*_from_facets(mesh, sound, longest, step), *_from_grooves(mesh, edges, sound, step)]
    thickness = [_measure(scene, sound, probe) for probe in probes]
    best = int(np.argmin([depth.min(initial=np.inf) for depth in thickness] or [0]))
    return _walls(probes, thickness, best)


def thin_area(walls: WallThickness, limit: float) -> float:
    """Surface over walls thinner than a limit, mm^2; walls of two sides count twice."""
    return float(walls.share[walls.thickness < limit].sum())


def _walls(probes: list[ThicknessRays], thickness: list[Floats], best: int) -> WallThickness:
    depths, shares = np.concatenate(thickness), np.concatenate([probe.share for probe in probes])
    if not np.isfinite(depths).any():
        return WallThickness(depths, shares, math.inf, np.full(3, np.nan))
    k = int(thickness[best].argmin())
    minimum = float(thickness[best][k])
    probe = probes[best]
    return WallThickness(
        depths, shares, minimum, probe.start[:, k] + minimum / 2 * probe.inward[:, k]
    )


def _measure(scene: RayScene, sound: Bools, probe: ThicknessRays) -> Floats:
    """(S,) distances to opposite sides that face the ray; infinite where none does."""
    lift = LIFT_ULP * float(np.spacing(np.float32(np.abs(probe.start).max(initial=1e-30))))

    def part(these: slice) -> Floats:
        start, d = probe.start[:, these], probe.inward[:, these]
        facet = first_hits(scene, start + lift * d, d)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = distances_to_planes(scene, facet, start, d)
        faces_ray = dot(np.take(scene.planes[:, :3], facet, axis=0).T, d) >= probe.min_cosine
        return np.where((facet >= 0) & sound[facet] & faces_ray, np.maximum(depth, 0), np.inf)

    return np.concatenate(in_threads(part, chunks(probe.share.size)) or [np.empty(0)])


def _from_facets(mesh: Mesh, sound: Bools, longest: Floats, step: float) -> Iterator[ThicknessRays]:
    size = _steps(np.where(sound, longest, 0), step)
    for k in LATTICES[::-1]:
        yield _on_lattice(mesh, np.flatnonzero(sound & (size == k)), _lattice(k))


def _steps(length: Floats, step: float) -> Ints:
    """(N,) into how many steps a length is divided, of `LATTICES`, within `MAX_RAYS` in all."""
    ideal = 2 ** np.ceil(np.log2(np.maximum(length / step, 1)))
    for most in LATTICES:
        size = np.minimum(ideal, most).astype(np.intp)
        if ((size > 1) * (size + 1) * (size + 2) / 2).sum() <= MAX_RAYS:
            return np.asarray(size)
    return np.ones(length.size, dtype=np.intp)


def _lattice(k: int) -> Floats:
    """(3, L) barycentric points: the middle, or all corners of k steps, drawn in a little."""
    if k == 1:
        return np.full((3, 1), 1 / 3)
    points = [(i, j, k - i - j) for i in range(k + 1) for j in range(k + 1 - i)]
    return (1 - INSET) * np.array(points, dtype=np.float64).T / k + INSET / 3


def _on_lattice(mesh: Mesh, facets: Ints, lattice: Floats) -> ThicknessRays:
    start = np.zeros((3, facets.size, lattice.shape[1]))
    for corner, weight in zip(mesh.faces[facets].T, lattice, strict=True):
        start += np.take(mesh.points, corner, axis=0).T[:, :, None] * weight
    count = lattice.shape[1]
    area = mesh.area[:, facets]
    inward = np.repeat(-unit(area), count, axis=1)
    share = np.repeat(norm(area) / (2 * count), count)
    return ThicknessRays(start.reshape(3, -1), inward, share, SQUARE_COS)


def _from_grooves(mesh: Mesh, edges: Edges, sound: Bools, step: float) -> Iterator[ThicknessRays]:
    """From the bottoms of grooves: rays from facets beside one miss the thin wall below it."""
    bend = -edges.angle
    half = edges.half[(bend > GROOVE_RAD + edges.noise) & (bend < SLIT_RAD)]
    half = half[sound[half // 3] & sound[mesh.twin[half] // 3]]
    start, edge = half_edge_vectors(mesh, half)
    size = _steps(norm(edge), step)
    inward = -unit(unit(mesh.area[:, half // 3]) + unit(mesh.area[:, mesh.twin[half] // 3]))
    for k in LATTICES[::-1]:
        mine = size == k
        yield _along(start[:, mine], edge[:, mine], inward[:, mine], k)


def _along(start: Floats, edge: Floats, inward: Floats, k: int) -> ThicknessRays:
    at = np.linspace(INSET, 1 - INSET, k + 1) if k > 1 else np.array([0.5])
    points = (start[:, :, None] + edge[:, :, None] * at).reshape(3, -1)
    return ThicknessRays(
        points, np.repeat(inward, at.size, axis=1), np.zeros(points.shape[1]), GROOVE_COS
    )
