"""Everything about one part's mesh that needs no printer, measured once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh import rays
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.segments import Edges, half_edge_vectors, measure_edges
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.printing.holes import RoundHoles, round_holes
from tbcad_verify.printing.orientations import PartHull, part_hull
from tbcad_verify.printing.pieces import MeshPieces, mesh_pieces
from tbcad_verify.printing.walls import WallThickness, wall_thickness
from tbcad_verify.types import Floats


@dataclass(frozen=True)
class InnerEdges:
    """Inner edges, where two faces meet at less than a half turn of air.

    Attributes:
        bend: (E,) rad between the faces' normals.
        length: (E,) mm.
    """

    bend: Floats
    length: Floats


@dataclass(frozen=True)
class PartMeasures:
    """One part.

    Attributes:
        mesh: its triangles.
        status: manifold3d's word; "NoError" is good.
        mass: volume, area, middle, box.
        pieces: separate solids, and closed cavities.
        walls: thickness.
        holes: round ones.
        inner_edges: concave ones.
        hull: convex hull, and how the part can rest.
    """

    mesh: Mesh
    status: str
    mass: MassProperties
    pieces: MeshPieces
    walls: WallThickness
    holes: RoundHoles
    inner_edges: InnerEdges
    hull: PartHull

    @property
    def triangles(self) -> int:
        """How many there are."""
        return len(self.mesh.faces)


def measure(mesh: Mesh, status: str, lump: MassProperties) -> PartMeasures:
    """Measure a mesh.

    Args:
        mesh: a part's; figures of one that is not closed mean little, its `status` says so.
        status: manifold3d's word.
        lump: the mesh's volume and so on.

    Raises:
        Unknown: all points lie in a plane: there is nothing to measure.
    """
    hull = part_hull(mesh.points)
    # Facets without area have edges without an angle; those are in doubt, and passed over.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        edges = measure_edges(mesh)
    return PartMeasures(
        mesh,
        status,
        lump,
        mesh_pieces(mesh),
        wall_thickness(mesh, edges, rays.build_scene(mesh)),
        round_holes(mesh, edges),
        _corners(mesh, edges),
        hull,
    )


def _corners(mesh: Mesh, edges: Edges) -> InnerEdges:
    inner = edges.angle < -edges.noise
    vectors = half_edge_vectors(mesh, edges.half[inner])[1]
    return InnerEdges(-edges.angle[inner], norm(vectors))
