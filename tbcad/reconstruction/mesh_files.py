"""A mesh with colours at its points as a file: glTF for browsers and Blender, PLY, STL."""

from typing import Any

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from tbcad.errors import InputError
from tbcad.formats.glb import UPRIGHT
from tbcad.srgb import srgb_light

SUFFIXES = (".glb", ".ply", ".stl")
LIGHT = "_LIGHT"  # glTF's COLOR_0 under a name that trimesh writes as it is, without 8 bits
UNLIT = "KHR_materials_unlit"


def mesh_file(mesh: trimesh.Trimesh, suffix: str) -> bytes:
    """The file of a mesh, the same bytes for the same mesh.

    Args:
        mesh: points in mm, with colours there (sRGB).
        suffix: .glb in metres and y up, as glTF demands; .ply in mm with colours; .stl in mm,
            binary, without colours.

    Raises:
        InputError: the suffix is another.
    """
    kind = suffix.lower()
    if kind not in SUFFIXES:
        raise InputError(f"{suffix!r} is no kind of mesh file: allowed are {', '.join(SUFFIXES)}")
    if kind == ".glb":
        return _glb(mesh)
    content = mesh.export(file_type=kind[1:])
    return content if isinstance(content, bytes) else content.encode("ascii")


def _glb(mesh: trimesh.Trimesh) -> bytes:
    """Colours are those of photographs, light included: no viewer is to light them again."""
    light = srgb_light(np.asarray(mesh.visual.vertex_colors)[:, :3] / 255).astype(np.float32)
    shown = trimesh.Trimesh(
        mesh.vertices, mesh.faces, process=False, vertex_attributes={LIGHT: light}
    )
    shown.visual = TextureVisuals(material=PBRMaterial(metallicFactor=0.0, roughnessFactor=1.0))
    scene = trimesh.Scene(base_frame="world")
    scene.add_geometry(shown, node_name="object", geom_name="object", transform=UPRIGHT)
    return bytes(export_glb(scene, include_normals=True, tree_postprocessor=_coloured))


def _coloured(tree: dict[str, Any]) -> None:
    """Name the colours as glTF 2.0, 3.7.2.1, and the material as unlit."""
    attributes = tree["meshes"][0]["primitives"][0]["attributes"]
    attributes["COLOR_0"] = attributes.pop(LIGHT)
    tree["materials"][0]["extensions"] = {UNLIT: {}}
    tree["extensionsUsed"] = [UNLIT]
