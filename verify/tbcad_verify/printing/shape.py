"""Everything about one part's mesh that needs no printer, measured once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh import rays
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.segments import Edges, measure_edges
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.printing.holes import Holes, holes
from tbcad_verify.printing.pieces import Pieces, pieces
from tbcad_verify.printing.resting import Hull, wrap
from tbcad_verify.printing.walls import Walls, walls
from tbcad_verify.types import Floats


@dataclass(frozen=True)
class Corners:
    """Inner edges, where two faces meet at less than a half turn of air.

    Attributes:
        bend: (E,) rad between the faces' normals.
        length: (E,) mm.
    """

    bend: Floats
    length: Floats


@dataclass(frozen=True)
class Shape:
    """One part.

    Attributes:
        mesh: its triangles.
        status: manifold3d's word; "NoError" is good.
        bulk: volume, area, middle, box.
        pieces: separate solids, and closed cavities.
        walls: thickness.
        holes: round ones.
        corners: inner edges.
        hull: convex hull, and how the part can rest.
    """

    mesh: Mesh
    status: str
    bulk: MassProperties
    pieces: Pieces
    walls: Walls
    holes: Holes
    corners: Corners
    hull: Hull

    @property
    def triangles(self) -> int:
        """How many there are."""
        return len(self.mesh.faces)


def measure(mesh: Mesh, status: str, lump: MassProperties) -> Shape:
    """Measure a mesh.

    Args:
        mesh: a part's; figures of one that is not closed mean little, its `status` says so.
        status: manifold3d's word.
        lump: the mesh's volume and so on.

    Raises:
        Unknown: all points lie in a plane: there is nothing to measure.
    """
    hull = wrap(mesh.points)
    # Facets without area have edges without an angle; those are in doubt, and passed over.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        edges = measure_edges(mesh)
    return Shape(
        mesh,
        status,
        lump,
        pieces(mesh),
        walls(mesh, edges, rays.build_scene(mesh)),
        holes(mesh, edges),
        _corners(mesh, edges),
        hull,
    )


def _corners(mesh: Mesh, edges: Edges) -> Corners:
    inner = edges.angle < -edges.noise
    start = mesh.faces.ravel()[edges.half[inner]]
    end = np.roll(mesh.faces, -1, axis=1).ravel()[edges.half[inner]]
    edge = np.take(mesh.points, end, axis=0).T - np.take(mesh.points, start, axis=0).T
    return Corners(-edges.angle[inner], norm(edge))
