"""Printed parts with what they are for, and their meshes as a slicer takes them."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from tbcad.cad.mesh import Mesh
from tbcad.cad.meshing import without_degenerate
from tbcad.prototype.printing.placing import PlacedSolid

# Base and caps turn, stage and frame are static; a tool is not in the assembly.
Role: TypeAlias = Literal["base", "cap", "stage", "frame", "tool"]


@dataclass(frozen=True)
class PrintedPart:
    """One printed part.

    Attributes:
        solid: in its place, and how it is laid on the bed.
        role: what it belongs to.
        what: it is for.
        ball: of a cap, the number of its seat, from 0; -1 for all others.
    """

    solid: PlacedSolid
    role: Role
    what: str
    ball: int = -1

    @property
    def name(self) -> str:
        """Name of the part and of its files."""
        return self.solid.name


def part_mesh(part: PrintedPart) -> Mesh:
    """The part's mesh on the printer's bed, its coordinates rounded to 32 bits as in an STL."""
    return rounded(part.solid.mesh_on_bed)


def rounded(mesh: Mesh) -> Mesh:
    """The mesh with coordinates rounded to 32 bits; vertices that become equal are merged."""
    single = mesh.vertices.astype(np.float32).astype(np.float64) + 0.0
    corners, group = np.unique(single, axis=0, return_inverse=True)
    return without_degenerate(corners, group.reshape(-1)[mesh.triangles])
