"""Everything about one part's mesh that does not depend on a printer, measured once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh import rays
from tbcad_verify.mesh.holes import RoundHoles, round_holes
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.mesh.mesh import Mesh, connected_groups, facet_volumes, paired_half_edges
from tbcad_verify.mesh.segments import Edges, half_edge_vectors, measure_edges
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.printing.orientations import PartHull, part_hull
from tbcad_verify.printing.walls import WallThickness, wall_thickness
from tbcad_verify.types import Floats


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

    Args:
        mesh: a part's; figures of one that is not closed mean little, as its `status` says.
        status: of manifold3d.
        mass: the mesh's mass properties.
        edges: of the mesh, if they are measured.
        scene: of the mesh, if there is one.

    Raises:
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
