"""Printed parts with what they are for, and their meshes as a slicer takes them."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tbcad.cad.mesh import Mesh
from tbcad.cad.solids import meshed, without_lost
from tbcad.prototype.printing.placing import PlacedSolid

# base and cap turn with the base, stage and frame stand still; a tool is not in the rig.
Role: TypeAlias = Literal["base", "cap", "stage", "frame", "tool"]

# The kernel's mesher takes the ends of an edge shorter than this for one, on one side at times.
SAME_MM = 2e-5


@dataclass(frozen=True)
class PrintedPart:
    """One printed part.

    Attributes:
        part: its solid, and how it is laid on the bed.
        role: what it belongs to.
        what: it is for.
        ball: of a cap, the number of its seat, from 0; -1 for all others.
        quantity: how many are printed.
    """

    part: PlacedSolid
    role: Role
    what: str
    ball: int = -1
    quantity: int = 1

    @property
    def name(self) -> str:
        """Name of the part and of its files."""
        return self.part.name


def printed(piece: PrintedPart, tolerance: float) -> Mesh:
    """The part's mesh on the printer's bed, its coordinates those of an STL, of 32 bits.

    Args:
        piece: to be printed.
        tolerance: largest distance of facets from the surface, mm.
    """
    return rounded(welded(meshed(piece.part.on_bed, tolerance)))


def welded(mesh: Mesh) -> Mesh:
    """The mesh with corners that are the same to SAME_MM made one, and lost facets dropped."""
    pairs = cKDTree(mesh.vertices).query_pairs(SAME_MM, output_type="ndarray")
    size = len(mesh.vertices)
    near = coo_array((np.ones(len(pairs)), pairs.T), shape=(size, size))
    count, of = connected_components(near, directed=False)
    first = np.zeros(count, dtype=np.int64)
    first[of[::-1]] = np.arange(size)[::-1]
    return without_lost(mesh.vertices[first], of.astype(np.int64)[mesh.triangles])


def rounded(mesh: Mesh) -> Mesh:
    """The mesh with coordinates of 32 bits; corners that become the same are one."""
    single = mesh.vertices.astype(np.float32).astype(np.float64) + 0.0
    corners, of = np.unique(single, axis=0, return_inverse=True)
    return without_lost(corners, of.reshape(-1)[mesh.triangles])
