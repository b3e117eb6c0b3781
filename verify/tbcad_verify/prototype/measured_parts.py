"""Printed parts as their files have them: read, checked as meshes, and put back in their places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mass import MassProperties, mass_properties
from tbcad_verify.mesh.mesh import Mesh, Topology, examine_topology, join_meshes, mesh_from_facets
from tbcad_verify.mesh.segments import Edges, count_folds, half_edge_vectors, measure_edges
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.record.prototype import Printed
from tbcad_verify.report.checks import Check, Unknown, at_most, check_names, guarded, reason_of
from tbcad_verify.shell.integrity import FOLDS, TOPOLOGY, fold_check, mesh_checks

ROTATION = 1e-9
BED_MM = 0.05
# Round bosses meet ribs in grooves that run out to a few degrees; what is closer is a fold.
FOLD_RAD = 0.02
POSE = {"print pose": "off a rotation", "on the bed": "mm"}


@dataclass(frozen=True)
class MeasuredPart:
    """One part.

    Attributes:
        part: its record.
        mesh: as it lies on the bed; None where it could not be made out.
        placed: the same in the frame of the shell, the base at angle zero.
        topology: of the mesh.
        mass: of the mesh on the bed.
        placed_mass: of the placed mesh.
        checks: of mesh and pose.
        reason: why something is None.
    """

    part: Printed
    mesh: Mesh | None
    placed: Mesh | None
    topology: Topology | None
    mass: MassProperties | None
    placed_mass: MassProperties | None
    checks: list[Check]
    reason: str

    @property
    def placed_mesh(self) -> Mesh:
        """The placed mesh.

        Raises:
            Unknown: there is none.
        """
        if self.placed is None:
            raise Unknown(self.reason)
        return self.placed


def measure_part(part: Printed, facets: Facets) -> MeasuredPart:
    """Measure one part's mesh."""
    try:
        mesh = mesh_from_facets(facets)
        edges = measure_edges(mesh)
        found = examine_topology(mesh, facets)
        placed = put_back(mesh, part)
        lump = replace(mass_properties(placed), bend=_bend(mesh, edges))
    except Exception as error:
        return MeasuredPart(
            part, None, None, None, None, None, _unknown(part, error), reason_of(error)
        )
    checks = _checks(
        part,
        lambda: [*mesh_checks(part.stl, found), fold_check(part.stl, count_folds(edges, FOLD_RAD))],
    )
    checks += guarded(check_names(POSE, part.stl), lambda: pose_checks(part, mesh))
    return MeasuredPart(part, mesh, placed, found, mass_properties(mesh), lump, checks, "")


def put_back(mesh: Mesh, part: Printed) -> Mesh:
    """A mesh moved from the bed to the frame of the shell."""
    points = np.einsum("ni,ji->nj", mesh.points - part.origin, part.axes)
    area = np.einsum("ji,in->jn", part.axes, mesh.area)
    return replace(mesh, points=points, area=area)


def pose_checks(part: Printed, mesh: Mesh) -> list[Check]:
    """The pose is a rotation, without mirroring, and the part lies on the bed and not in it."""
    gram = np.abs(part.axes @ part.axes.T - np.eye(3)).max()
    turn, bed = check_names(POSE, part.stl)
    off = max(float(gram), abs(float(np.linalg.det(part.axes)) - 1))
    low = float(mesh.points[:, 2].min())
    return [
        at_most(turn, off, ROTATION, "axes are no rotation"),
        at_most(bed, abs(low), BED_MM, f"the lowest point lies at z = {low:.3f} mm"),
    ]


def of_roles(bodies: list[MeasuredPart], *roles: str) -> list[MeasuredPart]:
    """Those of some roles."""
    return [one for one in bodies if one.part.role in roles]


def joined_meshes(bodies: list[MeasuredPart]) -> tuple[Mesh, NDArray[np.intp]]:
    """Placed meshes as one, and which body each facet is of.

    Raises:
        Unknown: one could not be made out.
    """
    meshes = [one.placed_mesh for one in bodies]
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    return join_meshes(meshes), owner


def _bend(mesh: Mesh, edges: Edges) -> float:
    length = norm(half_edge_vectors(mesh, edges.half)[1])
    return float((length * np.abs(edges.angle)).sum())


def _checks(part: Printed, work: Callable[[], list[Check]]) -> list[Check]:
    return guarded(check_names({**TOPOLOGY, **FOLDS}, part.stl), work)


def _unknown(part: Printed, error: Exception) -> list[Check]:
    def broken() -> list[Check]:
        raise error

    names = check_names({**TOPOLOGY, **FOLDS, **POSE}, part.stl)
    return guarded(names, broken)
