"""The meshes of the shells, measured one by one; a mirror image of the first is not again.

Camera b's shell is camera a's, reflected in x = 0. Where the facets in both files are the same to
the last bit but for the sign of x and the order of each facet's corners, every figure of one
follows from the other's; where a single bit differs, nothing does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tbcad_verify.mesh.holes import RoundHoles
from tbcad_verify.mesh.mesh import (
    MassProperties,
    Mesh,
    Topology,
    examine_topology,
    mass_properties,
    mesh_from_facets,
)
from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.segments import Edges, measure_edges, total_bend
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.printing.orientations import part_hull
from tbcad_verify.printing.part_measures import PartMeasures, WallThickness
from tbcad_verify.record.export import Export, Part
from tbcad_verify.report.checks import Check, attempt, check_names, guarded, require
from tbcad_verify.shell.integrity import FOLDS, TOPOLOGY, fold_check, mesh_checks
from tbcad_verify.shell.optics import FLIP, pinhole_of
from tbcad_verify.shell.recover import Recovery, recover
from tbcad_verify.types import Floats

# The half-edge between the same two corners when a facet's three are taken in reverse.
REVERSED = np.array([1, 0, 2])


@dataclass(frozen=True)
class ShellPart:
    """One part of a shell as measured; None where that failed."""

    part: Part  # its record
    checks: list[Check]  # of the mesh
    mesh: Mesh | None  # its triangles, joined
    topology: Topology | None  # what is wrong with the mesh
    mass: MassProperties | None  # volume, area, centroid and box
    recovery: Recovery | None  # its patches and mirrors
    reason: str  # why something is None
    edges: Edges | None  # of the mesh; None for a mirror image too
    # the part of which this is the mirror image; None where it was measured by itself
    image_of: Part | None = None

    def mirror_image(self, part: Part) -> ShellPart:
        """The same of a part whose mesh is this one's, reflected in the plane x = 0."""
        return replace(
            self,
            part=part,
            checks=[replace(check, file=part.stl) for check in self.checks],
            mesh=self.mesh and flipped_mesh(self.mesh),
            edges=None,
            mass=self.mass and flipped_mass(self.mass),
            recovery=self.recovery and flipped_recovery(self.recovery),
            image_of=self.part,
        )


def measure_shells(export: Export, stls: list[Facets]) -> list[ShellPart]:
    """Every shell of a build, given the facets of each."""
    if _second_is_image(export, stls):
        first = _measure_shell(export, export.parts[0], stls[0])
        return [first, first.mirror_image(export.parts[1])]
    pairs = list(zip(export.parts, stls, strict=True))
    return in_threads(lambda pair: _measure_shell(export, *pair), pairs)


def _second_is_image(export: Export, stls: list[Facets]) -> bool:
    """Whether there are two shells, and mesh and camera of one are the other's mirror image."""
    if len(stls) != 2:
        return False
    one, other = (pinhole_of(export, part) for part in export.parts)
    if one is None or other is None or not np.array_equal(one * FLIP, other):
        return False
    return is_mirror_image(*stls)


def _measure_shell(export: Export, part: Part, facets: Facets) -> ShellPart:
    mesh, no_mesh = attempt(lambda: mesh_from_facets(facets))
    known = partial(require, mesh, no_mesh)
    topology, no_topology = attempt(lambda: examine_topology(known(), facets))
    mass, no_mass = attempt(lambda: mass_properties(known()))
    edges, _ = attempt(lambda: measure_edges(known()))
    if mass and edges and mesh and export.spec.shell.edges == "pedestal":  # walls lose along edges
        mass = replace(mass, bend=total_bend(mesh, edges))
    recovery, no_recovery = attempt(
        lambda: recover(known(), pinhole_of(export, part), export.target_mm / 2, edges)
    )
    solid, smooth = check_names(TOPOLOGY, part.stl), check_names(FOLDS, part.stl)
    checks = guarded(solid, lambda: mesh_checks(part.stl, require(topology, no_topology)))
    folds = guarded(smooth, lambda: [fold_check(part.stl, require(recovery, no_recovery).folds)])
    reason = no_mesh or no_recovery or no_topology or no_mass
    return ShellPart(part, checks + folds, mesh, topology, mass, recovery, reason, edges)


def is_mirror_image(one: Facets, other: Facets) -> bool:
    """Whether two files hold the same facets, in the same order, but for the reflection."""
    flip = FLIP.astype(np.float32)
    return (
        one.corners.shape == other.corners.shape
        and np.array_equal(one.corners[:, ::-1] * flip, other.corners)
        and np.array_equal(one.normals * flip, other.normals)
    )


def flipped_mesh(mesh: Mesh) -> Mesh:
    """The mesh of the mirror image, its facets and vertices in the same order."""
    twin = mesh.twin.reshape(-1, 3)[:, REVERSED].ravel()
    twin = np.where(twin < 0, -1, twin - twin % 3 + REVERSED[twin % 3]).astype(np.int32)
    faces = np.ascontiguousarray(mesh.faces[:, ::-1])
    return Mesh(mesh.points * FLIP, faces, twin, _flipped_columns(mesh.area))


def flipped_mass(mass: MassProperties) -> MassProperties:
    """Volume, area, centroid and box of the mirror image."""
    low, high = [-mass.high[0], *mass.low[1:]], [-mass.low[0], *mass.high[1:]]
    centroid = [-mass.centroid[0], *mass.centroid[1:]]
    return replace(mass, centroid=centroid, low=low, high=high)


def flipped_recovery(recovery: Recovery) -> Recovery:
    """The patches of the mirror image, under the same numbers."""
    fits = recovery.fits
    surfaces = Surfaces(
        _flipped_columns(fits.surfaces.point),
        _flipped_columns(fits.surfaces.normal),
        fits.surfaces.curvature,
    )
    middle, normal = _flipped_columns(fits.middle), _flipped_columns(fits.normal)
    return replace(recovery, fits=replace(fits, surfaces=surfaces, middle=middle, normal=normal))


def flipped_measures(measures: PartMeasures, mesh: Mesh, mass: MassProperties) -> PartMeasures:
    """Figures of the mirror image for printers, given its mesh and mass."""
    walls, holes = measures.walls, measures.holes
    return replace(
        measures,
        mesh=mesh,
        mass=mass,
        walls=WallThickness(walls.thickness, walls.share, walls.minimum, walls.where * FLIP),
        holes=RoundHoles(
            holes.diameter,
            _flipped_columns(holes.middle),
            _flipped_columns(holes.axis),
            holes.depth,
            holes.wall,
        ),
        hull=part_hull(mesh.points),
    )


def _flipped_columns(columns: Floats) -> Floats:
    """Mirror images of points or directions (3, N)."""
    return np.asarray(columns * FLIP[:, None])
