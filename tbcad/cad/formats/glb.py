"""prototype.glb: the same tree to look at in a browser; metres and y up, as glTF demands."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from tbcad.cad.kernel.assembly import ColouredMesh, MeshGroup
from tbcad.common.colours import srgb_light

# Rows: what metres along glTF's x, y and z are in millimetres of the frame of the shell.
UPRIGHT = np.array([[1e-3, 0, 0, 0], [0, 0, 1e-3, 0], [0, -1e-3, 0, 0], [0, 0, 0, 1.0]])
METAL, ROUGH = 0.1, 0.6


def write_glb(path: Path, name: str, groups: Sequence[MeshGroup]) -> None:
    """Write groups of meshes as a binary glTF 2.0 file, a node for each group and each mesh."""
    scene = trimesh.Scene(base_frame="world")
    scene.graph.update(name, "world", matrix=UPRIGHT)
    for group in groups:
        scene.graph.update(group.name, name, matrix=np.eye(4))
        for body in group.bodies:
            scene.add_geometry(
                _drawn(body),
                node_name=body.name,
                geom_name=body.name,
                parent_node_name=group.name,
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
