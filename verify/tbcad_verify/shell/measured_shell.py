"""The meshes of the shells, measured one by one; a mirror image of the first is not again."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tbcad_verify.mesh.mass import MassProperties, mass_properties
from tbcad_verify.mesh.mesh import Mesh, Topology, examine_topology, mesh_from_facets
from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.segments import Edges, measure_edges
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.record.export import Export, Part
from tbcad_verify.report.checks import Check, attempt, check_names, guarded, require
from tbcad_verify.shell.integrity import FOLDS, TOPOLOGY, fold_check, mesh_checks
from tbcad_verify.shell.mirror_image import (
    FLIP,
    flipped_edges,
    flipped_mass,
    flipped_mesh,
    flipped_recovery,
    is_mirror_image,
)
from tbcad_verify.shell.optics import pinhole_of
from tbcad_verify.shell.recover import Recovery, recover


@dataclass(frozen=True)
class ShellPart:
    """One part of a shell as measured; None where that failed."""

    part: Part  # its record
    mesh: Mesh | None  # its triangles, joined
    edges: Edges | None  # of the mesh
    topology: Topology | None  # what is wrong with the mesh
    mass: MassProperties | None  # volume, area, centroid and box
    recovery: Recovery | None  # its patches and mirrors
    no_topology: str  # why the topology is None
    no_recovery: str  # why the recovery is None
    reason: str  # why something is None
    # the part of which this is the mirror image; None where it was measured by itself
    image_of: Part | None = None

    @property
    def checks(self) -> list[Check]:
        """Of the mesh."""
        name = self.part.stl
        return guarded(
            check_names(TOPOLOGY, name),
            lambda: mesh_checks(name, require(self.topology, self.no_topology)),
        ) + guarded(
            check_names(FOLDS, name),
            lambda: [fold_check(name, require(self.recovery, self.no_recovery).folds)],
        )

    def mirror_image(self, part: Part) -> ShellPart:
        """The same of a part whose mesh is this one's, reflected in the plane x = 0."""
        return replace(
            self,
            part=part,
            mesh=self.mesh and flipped_mesh(self.mesh),
            edges=self.edges and flipped_edges(self.edges),
            mass=self.mass and flipped_mass(self.mass),
            recovery=self.recovery and flipped_recovery(self.recovery),
            image_of=self.part,
        )


def measure_shells(export: Export, stls: list[Facets]) -> list[ShellPart]:
    """Every shell of an export, given the facets of each."""
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
    radius_mm, pinhole = export.target_mm / 2, pinhole_of(export, part)
    mesh, no_mesh = attempt(lambda: mesh_from_facets(facets))
    topology, no_topology = attempt(lambda: examine_topology(require(mesh, no_mesh), facets))
    mass, no_mass = attempt(lambda: mass_properties(require(mesh, no_mesh)))
    edges, _ = attempt(lambda: measure_edges(require(mesh, no_mesh)))
    recovery, no_recovery = attempt(
        lambda: recover(require(mesh, no_mesh), pinhole, radius_mm, edges)
    )
    reason = no_mesh or no_recovery or no_topology or no_mass
    return ShellPart(part, mesh, edges, topology, mass, recovery, no_topology, no_recovery, reason)
