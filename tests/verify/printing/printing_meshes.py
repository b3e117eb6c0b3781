"""Meshes with closed forms, as a file would hold them: float32."""

from __future__ import annotations

import math

import numpy as np
import trimesh
from tbcad_verify.mesh.mesh import Mesh, manifold_status, mass_properties, mesh_from_facets
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.printing.part_measures import PartMeasures, measure


def mesh_of(*solids: trimesh.Trimesh) -> Mesh:
    """All solids in one mesh, by way of float32 corners."""
    corners = np.concatenate([solid.triangles for solid in solids]).astype(np.float32)
    return mesh_from_facets(Facets("x.stl", np.zeros((len(corners), 3), np.float32), corners))


def shape(*solids: trimesh.Trimesh) -> PartMeasures:
    """All solids in one mesh, measured."""
    mesh = mesh_of(*solids)
    return measure(mesh, manifold_status(mesh), mass_properties(mesh))


def box(*sides: float, at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    return trimesh.creation.box(sides).apply_translation(at)


def turned_inside_out(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(solid.vertices, solid.faces[:, ::-1], process=False)


def turned(solid: trimesh.Trimesh, degrees: float, about: tuple[float, float, float]) -> object:
    matrix = trimesh.transformations.rotation_matrix(math.radians(degrees), about)
    return solid.copy().apply_transform(matrix)


def plate(outline: np.ndarray, holes: list[np.ndarray], thick: float) -> trimesh.Trimesh:
    """A plate from z = 0 up, of a convex outline with holes: rings of (N, 2) corners."""
    import manifold3d

    section = manifold3d.CrossSection([outline, *[ring[::-1] for ring in holes]])
    solid = manifold3d.Manifold.extrude(section, thick).to_mesh()
    return trimesh.Trimesh(solid.vert_properties[:, :3], solid.tri_verts, process=False)


def ring(radius: float, corners: int, x: float = 0, y: float = 0, start: float = 0) -> np.ndarray:
    """Corners of a regular polygon on a circle, counter-clockwise."""
    angle = math.radians(start) + 2 * np.pi * np.arange(corners) / corners
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])


def rectangle(width: float, depth: float) -> np.ndarray:
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, depth / 2]


def prism(outline: list[tuple[float, float]], length: float) -> trimesh.Trimesh:
    """An outline in the plane x z, drawn out along y."""
    solid = plate(np.array(outline, dtype=float), [], length)
    solid.vertices = solid.vertices[:, [0, 2, 1]]
    solid.faces = solid.faces[:, ::-1]
    return solid
