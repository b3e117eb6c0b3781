"""A field for other programs: its surface as a mesh, and the whole as a volume.

A mesh with colours at its points is glTF for browsers and Blender, PLY or STL. A volume is VTK's
image data (.vti) for ParaView and PyVista: dense, so every reader understands it. NumPy has the
same from the field's file:

    field = np.load("field.npz")
    at = tuple(field["node"].T)
    density = np.zeros((field["nodes"],) * 3, np.float32); x = field["density"]
    density[at] = (x + np.sqrt(x * x + 0.01)) / 2
    colour = np.zeros((*density.shape, 3), np.float32); colour[at] = field["colour"]

Values between a volume's nodes are those of a linear density, a little softer than the field's own.
"""

from typing import Any

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from tbcad.cad.formats.assembly import UPRIGHT
from tbcad.common.figure_files import srgb_light
from tbcad.errors import InputError
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.marching import MATT

MESH_SUFFIXES = (".glb", ".ply", ".stl")
LIGHT = "_LIGHT"  # glTF's COLOR_0 under a name that trimesh writes as it is, without 8 bits
UNLIT = "KHR_materials_unlit"
VOLUME_SUFFIX = ".vti"


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
    if kind not in MESH_SUFFIXES:
        raise InputError(
            f"{suffix!r} is no kind of mesh file: allowed are {', '.join(MESH_SUFFIXES)}"
        )
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


def volume_file(made: Field) -> bytes:
    """The file of a field: `density`, 1/mm, and `colour`, 0 to 1, at all nodes of its cube, mm.

    Of a view-dependent field it has the colours without what depends on the direction.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

    grid, corner = made.grid, -made.grid.width_mm / 2
    image = vtkImageData()
    image.SetDimensions(grid.n, grid.n, grid.n)
    image.SetOrigin(corner, corner, corner)
    image.SetSpacing(grid.pitch_mm, grid.pitch_mm, grid.pitch_mm)
    colours = [np.clip(column, 0, 1) for column in made.values[:, 1:MATT].T]
    for name, columns in {"density": [made.density()], "colour": colours}.items():
        dense = [grid.dense(column.astype(np.float32)).ravel(order="F") for column in columns]
        values = numpy_to_vtk(np.column_stack(dense), deep=True)
        values.SetName(name)
        image.GetPointData().AddArray(values)
    image.GetPointData().SetActiveScalars("density")
    writer = vtkXMLImageDataWriter()
    writer.SetInputData(image)
    writer.SetHeaderTypeToUInt64()
    writer.WriteToOutputStringOn()
    writer.EncodeAppendedDataOn()
    writer.Write()
    return str(writer.GetOutputString()).encode("ascii")
