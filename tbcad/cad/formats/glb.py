"""Coloured meshes in groups as binary glTF 2.0, to look at: the same bytes each time.

glTF demands metres and y up.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from tbcad.cad.kernel.mesh import Mesh
from tbcad.common.figure_files import shown_colour, srgb_light

Colour: TypeAlias = tuple[float, ...]
"""Red, green, blue (sRGB) and opacity, from 0 to 1."""

# Rows: what metres along glTF's x, y and z are in millimetres of the frame of the shell.
UPRIGHT = np.array([[1e-3, 0, 0, 0], [0, 0, 1e-3, 0], [0, -1e-3, 0, 0], [0, 0, 0, 1.0]])
SHELL_FRAME = 1e3 * np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # back again
METAL, ROUGH = 0.1, 0.6


@dataclass(frozen=True)
class ColouredMesh:
    """What is seen of one body."""

    name: str  # unique in the file
    group: str  # that it belongs to
    mesh: Mesh  # in its place
    colour: Colour  # of it


def write_glb(path: Path, name: str, bodies: Iterable[ColouredMesh]) -> None:
    """Write meshes, a node for each group and each mesh."""
    scene = trimesh.Scene(base_frame="world")
    scene.graph.update(name, "world", matrix=UPRIGHT)
    for body in bodies:
        if body.group not in scene.graph.nodes:
            scene.graph.update(body.group, name, matrix=np.eye(4))
        scene.add_geometry(
            _drawn(body), node_name=body.name, geom_name=body.name, parent_node_name=body.group
        )
    # Without normals viewers must shade each facet flat (glTF 2.0, 3.7.2.1), as it is.
    path.write_bytes(export_glb(scene, include_normals=False))


def _drawn(body: ColouredMesh) -> trimesh.Trimesh:
    drawn = trimesh.Trimesh(body.mesh.vertices, body.mesh.triangles, process=False)
    drawn.visual = TextureVisuals(
        material=PBRMaterial(
            name=body.name,
            # light, not its code (glTF 2.0, 3.9.2)
            baseColorFactor=[*srgb_light(np.array(body.colour[:3])), body.colour[3]],
            metallicFactor=METAL,
            roughnessFactor=ROUGH,
            alphaMode="BLEND" if body.colour[3] < 1 else "OPAQUE",
        )
    )
    return drawn


def read_glb(path: Path) -> list[ColouredMesh]:
    """All meshes of a file as `write_glb` writes it, by name."""
    scene = trimesh.load_scene(path)
    bodies = []
    for name in sorted(scene.graph.nodes_geometry):
        place, geometry = scene.graph[name]
        mesh = scene.geometry[geometry]
        points = trimesh.transform_points(mesh.vertices, place) @ SHELL_FRAME
        group = str(scene.graph.transforms.parents[name])
        colour = shown_colour(mesh.visual.material.baseColorFactor)
        bodies.append(ColouredMesh(name, group, Mesh(points, np.asarray(mesh.faces)), colour))
    return bodies
