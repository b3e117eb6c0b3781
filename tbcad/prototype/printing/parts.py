"""Printed parts with what they are for, and their meshes as a slicer takes them."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tbcad.cad.mesh import Mesh
from tbcad.cad.meshing import meshed, without_degenerate
from tbcad.prototype.printing.placing import PlacedSolid

# Base and caps turn, stage and frame are static; a tool is not in the assembly.
Role: TypeAlias = Literal["base", "cap", "stage", "frame", "tool"]

# The kernel's mesher sometimes merges the ends of an edge shorter than this on one side only.
MERGE_MM = 2e-5


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


def part_mesh(part: PrintedPart, tolerance: float) -> Mesh:
    """The part's mesh on the printer's bed, its coordinates rounded to 32 bits as in an STL.

    Args:
        part: to be printed.
        tolerance: largest distance of facets from the surface, mm.
    """
    return rounded(welded(meshed(part.solid.on_bed, tolerance)))


def welded(mesh: Mesh) -> Mesh:
    """The mesh with corners that are the same to SAME_MM made one, and lost facets dropped."""
    pairs = cKDTree(mesh.vertices).query_pairs(MERGE_MM, output_type="ndarray")
    size = len(mesh.vertices)
    near = coo_array((np.ones(len(pairs)), pairs.T), shape=(size, size))
    _, group = connected_components(near, directed=False)
    _, first = np.unique(group, return_index=True)
    return without_degenerate(mesh.vertices[first], group.astype(np.int64)[mesh.triangles])


def rounded(mesh: Mesh) -> Mesh:
    """The mesh with coordinates rounded to 32 bits; vertices that become equal are merged."""
    single = mesh.vertices.astype(np.float32).astype(np.float64) + 0.0
    corners, group = np.unique(single, axis=0, return_inverse=True)
    return without_degenerate(corners, group.reshape(-1)[mesh.triangles])
