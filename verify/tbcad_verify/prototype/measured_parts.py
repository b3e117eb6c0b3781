"""Printed parts as their files have them: read, checked as meshes, and put back in their places."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tbcad_verify.mesh.mesh import (
    MassProperties,
    Mesh,
    Topology,
    examine_topology,
    mass_properties,
    mesh_from_facets,
)
from tbcad_verify.mesh.segments import Edges, count_folds, measure_edges, total_bend
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.record.prototype import PrintedPart
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_most,
    check_names,
    guarded,
    reason_of,
    require,
    unknown,
)
from tbcad_verify.shell.integrity import FOLDS, TOPOLOGY, fold_check, mesh_checks
from tbcad_verify.types import Floats

ROTATION = 1e-9  # largest deviation of the axes from a rotation
BED_MM = 0.05
# Round bosses meet ribs in grooves that run out to a few degrees; a sharper bend is a fold.
FOLD_RAD = 0.02
PLACED = ("base", "cap", "stage", "frame")  # roles of the parts that are in the prototype
POSE = {"print pose": "off a rotation", "on the bed": "mm"}


@dataclass(frozen=True)
class MeasuredPart:
    """One part; what could not be measured is None."""

    part: PrintedPart  # its record
    checks: list[Check]  # of mesh and pose
    reason: str = ""  # why something is None
    mesh: Mesh | None = None  # as it lies on the bed
    placed: Mesh | None = None  # the same in the frame of the shell, the base at angle zero
    topology: Topology | None = None  # of the mesh
    mass: MassProperties | None = None  # of the mesh on the bed
    placed_mass: MassProperties | None = None  # of the placed mesh
    edges: Edges | None = None  # of the mesh

    @property
    def placed_mesh(self) -> Mesh:
        """The placed mesh. Unknown: there is none."""
        return require(self.placed, self.reason)

    @cached_property
    def solid(self) -> Any:
        """The placed mesh as manifold3d has it, built once for all checks.

        Unknown: there is no mesh.
        """
        return manifold(self.placed_mesh.points, self.placed_mesh.faces)


def measure_part(part: PrintedPart, facets: Facets) -> MeasuredPart:
    """Measure one part's mesh."""
    solid, pose = check_names(TOPOLOGY | FOLDS, part.stl), check_names(POSE, part.stl)
    try:
        mesh = mesh_from_facets(facets)
        edges = measure_edges(mesh)
        topology = examine_topology(mesh, facets)
        placed = put_back(mesh, part)
        placed_mass = replace(mass_properties(placed), bend=total_bend(mesh, edges))
    except Exception as error:
        reason = reason_of(error)
        return MeasuredPart(part, [unknown(name, reason) for name in solid + pose], reason)
    folds = fold_check(part.stl, count_folds(edges, FOLD_RAD))
    checks = guarded(solid, lambda: [*mesh_checks(part.stl, topology), folds])
    checks += guarded(pose, lambda: pose_checks(pose, part, mesh))
    mass = mass_properties(mesh)
    return MeasuredPart(part, checks, "", mesh, placed, topology, mass, placed_mass, edges)


def put_back(mesh: Mesh, part: PrintedPart) -> Mesh:
    """A mesh moved from the bed to the frame of the shell."""
    points = np.einsum("ni,ji->nj", mesh.points - part.origin, part.axes)
    area = np.einsum("ji,in->jn", part.axes, mesh.area)
    return replace(mesh, points=points, area=area)


def pose_checks(names: list[CheckName], part: PrintedPart, mesh: Mesh) -> list[Check]:
    """The pose is a rotation without mirroring, and the part touches the bed from above."""
    rotation, bed = names
    gram = np.abs(part.axes @ part.axes.T - np.eye(3)).max()
    error = max(float(gram), abs(float(np.linalg.det(part.axes)) - 1))
    low = float(mesh.points[:, 2].min())
    return [
        at_most(rotation, error, ROTATION, "axes are no rotation"),
        at_most(bed, abs(low), BED_MM, f"the lowest point lies at z = {low:.3f} mm"),
    ]


def of_roles(parts: list[MeasuredPart], *roles: str) -> list[MeasuredPart]:
    """The parts of some roles."""
    return [part for part in parts if part.part.role in roles]


def manifold(points: Floats, faces: Any) -> Any:
    """The solid that manifold3d makes of points (V, 3), mm, and facets (F, 3)."""
    import manifold3d

    mesh = manifold3d.Mesh64(np.ascontiguousarray(points), faces.astype(np.uint64))
    return manifold3d.Manifold(mesh)
