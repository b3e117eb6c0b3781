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

from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from tbcad.cad.formats.glb import UPRIGHT
from tbcad.common.figure_files import srgb_light
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.marching import MATT, Singles
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import embree_scene
from tbcad.types import Floats

MESH_SUFFIXES = (".glb", ".ply", ".stl")
LIGHT = "_LIGHT"  # glTF's COLOR_0 under a name that trimesh writes as it is, without 8 bits
UNLIT = "KHR_materials_unlit"
VOLUME_SUFFIX = ".vti"
SAMPLES = 100_000  # points on each whole surface
SEED = 0
CELL_MM = 0.25  # of what is seen, one point in each cell of that size


def mesh_file(mesh: trimesh.Trimesh, suffix: str) -> bytes:
    """The file of a mesh in mm with colours (sRGB) at its points; the same bytes for the same mesh.

    By the suffix: .glb in metres and y up, as glTF demands; .ply in mm with colours; .stl in mm,
    binary, without colours.
    """
    kind = suffix.lower()[1:]
    if kind == "glb":
        return _glb(mesh)
    content = mesh.export(file_type=kind)
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


@dataclass(frozen=True)
class MeshDistance:
    """Distances between two surfaces, mm.

    Means are over the points of both; a Hausdorff distance is the largest of any point to the
    other surface. Distances of points are exact; between the points a Hausdorff distance may be
    larger by no more than their distance, about 0.25 mm.
    """

    mean_mm: float  # of points that some captured ray meets first
    percentile_95_mm: float  # of the same
    hausdorff_mm: float  # of the same
    # of points spread evenly over all of both surfaces, the underside and what lies inside
    # included, which no ray shows
    whole_mean_mm: float
    whole_hausdorff_mm: float  # of the same


def mesh_distance(mesh: trimesh.Trimesh, truth: SceneObject, rays: CapturedRays) -> MeshDistance:
    """Compare a found mesh, mm, with the true object; what rays meet first of it is seen."""
    true = trimesh.Trimesh(truth.points, truth.faces, process=False)
    seen = _both(mesh, true, _seen(mesh, rays), _seen(true, rays))
    whole = _both(mesh, true, _even(mesh), _even(true))
    return MeshDistance(
        float(seen.mean()),
        float(np.percentile(seen, 95)) if len(seen) else float("nan"),
        float(seen.max(initial=0.0)),
        float(whole.mean()),
        float(whole.max()),
    )


def _both(found: trimesh.Trimesh, true: trimesh.Trimesh, first: Floats, second: Floats) -> Floats:
    """Distances of points on one to the other, and the other way round."""
    return np.concatenate([_distances(first, true), _distances(second, found)])


def _distances(points: Floats, surface: trimesh.Trimesh) -> Floats:
    """Distances (n,) of points (n, 3) to the nearest of a surface's facets."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    places, facets = vtkPoints(), vtkCellArray()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(surface.vertices, dtype=np.float64)))
    corners = np.ascontiguousarray(surface.faces, dtype=np.int64)
    facets.SetData(3, numpy_to_vtkIdTypeArray(corners.ravel()))
    body = vtkPolyData()
    body.SetPoints(places)
    body.SetPolys(facets)
    measure, result = vtkImplicitPolyDataDistance(), vtkDoubleArray()
    measure.SetInput(body)
    measure.FunctionValue(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float64)), result)
    return np.asarray(np.abs(vtk_to_numpy(result)))


def _even(surface: trimesh.Trimesh) -> Floats:
    points = trimesh.sample.sample_surface(surface, SAMPLES, seed=SEED)[0]
    return np.asarray(points, dtype=np.float64)


def _seen(surface: trimesh.Trimesh, rays: CapturedRays) -> Floats:
    """Points that rays meet first, at most one in each cell of a lattice."""
    scene = embree_scene(np.asarray(surface.vertices), np.asarray(surface.faces))
    hits = scene.run(rays.entry, rays.direction, output=1)
    met = hits["primID"] >= 0
    points: Singles = rays.entry[met] + hits["tfar"][met][:, None] * rays.direction[met]
    cells = np.floor(points / CELL_MM).astype(np.int64)
    first = np.unique(cells, axis=0, return_index=True)[1]
    return points[first].astype(np.float64)
