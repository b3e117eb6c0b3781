"""Everything about one part's mesh that does not depend on a printer, measured once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh import rays
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.mesh.mesh import Mesh, connected_groups
from tbcad_verify.mesh.segments import Edges, half_edge_vectors, measure_edges
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.printing.holes import RoundHoles, round_holes
from tbcad_verify.printing.orientations import PartHull, part_hull
from tbcad_verify.printing.walls import WallThickness, wall_thickness
from tbcad_verify.types import Floats


@dataclass(frozen=True)
class InnerEdges:
    """Inner edges, where the air between two faces fills less than a half turn.

    Attributes:
        bend: (E,) rad between the faces' normals.
        length: (E,) mm.
    """

    bend: Floats
    length: Floats


@dataclass(frozen=True)
class MeshPieces:
    """Numbers of connected surfaces.

    Attributes:
        solids: that enclose material; more than one means loose shells.
        cavities: that enclose a void: turned inside out.
    """

    solids: int
    cavities: int


@dataclass(frozen=True)
class PartMeasures:
    """One part.

    Attributes:
        mesh: its triangles.
        status: of manifold3d; "NoError" is good.
        mass: volume, area, centroid, box.
        pieces: separate solids, and closed cavities.
        walls: thickness.
        holes: round ones.
        inner_edges: between concave faces.
        hull: convex hull, and the orientations to try.
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
        """Their number."""
        return len(self.mesh.faces)


def measure(mesh: Mesh, status: str, mass: MassProperties) -> PartMeasures:
    """Measure a mesh.

    Args:
        mesh: a part's; figures of one that is not closed mean little, as its `status` says.
        status: of manifold3d.
        mass: the mesh's mass properties.

    Raises:
        Unknown: all points lie in a plane: there is nothing to measure.
    """
    hull = part_hull(mesh.points)
    # Facets without area have edges without an angle; those are uncertain, and left out.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        edges = measure_edges(mesh)
    return PartMeasures(
        mesh,
        status,
        mass,
        count_pieces(mesh),
        wall_thickness(mesh, edges, rays.build_scene(mesh)),
        round_holes(mesh, edges),
        _inner_edges(mesh, edges),
        hull,
    )


def count_pieces(mesh: Mesh) -> MeshPieces:
    """Connected surfaces by the sign of their volume."""
    half = np.flatnonzero(mesh.twin > np.arange(mesh.twin.size))
    count, label = connected_groups(len(mesh.faces), half // 3, mesh.twin[half] // 3)
    corner = np.take(mesh.points - mesh.points.mean(axis=0), mesh.faces[:, 0], axis=0)
    volume = np.einsum("ni,in->n", corner, mesh.area)
    inside_out = int((np.bincount(label, volume, count) < 0).sum())
    return MeshPieces(count - inside_out, inside_out)


def _inner_edges(mesh: Mesh, edges: Edges) -> InnerEdges:
    inner = edges.angle < -edges.noise
    vectors = half_edge_vectors(mesh, edges.half[inner])[1]
    return InnerEdges(-edges.angle[inner], norm(vectors))
