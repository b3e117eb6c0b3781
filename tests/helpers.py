"""Reading back what tbcad wrote, by other means than it was written with where there are any."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import lib3mf
import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, Mesh64
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.Geom import Geom_CylindricalSurface
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.StepShape import StepShape_AdvancedFace
from OCP.TopAbs import TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.meshing import meshed
from tbcad.cad.kernel.solids import faces


def bounds(shape: TopoDS_Shape) -> np.ndarray:
    """Smallest and largest coordinates, mm, (2, 3)."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    return np.array(box.Get()).reshape(2, 3)


@dataclass(frozen=True)
class StepContent:
    """What a STEP file holds when the kernel reads it anew."""

    shape: TopoDS_Shape
    solids: int
    valid: bool
    faces: dict[str, TopoDS_Face]
    kinds: Counter[str]


def read_step(path: Path) -> StepContent:
    """Read a STEP file; faces by the names in the file."""
    reader = STEPControl_Reader()
    assert reader.ReadFile(str(path)) == IFSelect_RetDone
    reader.TransferRoots()
    shape = reader.OneShape()
    transfer = reader.WS().TransferReader()
    model, faces, kinds = reader.StepModel(), {}, Counter()
    for k in range(1, model.NbEntities() + 1):
        entity = model.Value(k)
        if isinstance(entity, StepShape_AdvancedFace):
            faces[entity.Name().ToCString()] = TopoDS.Face_s(transfer.ShapeResult(entity))
            kinds[type(entity.FaceGeometry()).__name__] += 1
    return StepContent(
        shape, count(shape, TopAbs_SOLID), BRepCheck_Analyzer(shape).IsValid(), faces, kinds
    )


def check_step(path: Path, built: Solid) -> StepContent:
    """A STEP file holds one solid, valid, with the faces and the size of that which was built."""
    content = read_step(path)
    assert content.solids == 1
    assert content.valid
    assert volume(content.shape) == pytest.approx(volume(built.shape), rel=1e-9)
    assert area(content.shape) == pytest.approx(area(built.shape), rel=1e-9)
    assert set(content.faces) == {name for name, _ in built.faces}
    return content


def count(shape: TopoDS_Shape, kind: object) -> int:
    explorer, total = TopExp_Explorer(shape, kind), 0
    while explorer.More():
        total += 1
        explorer.Next()
    return total


def volume(shape: TopoDS_Shape) -> float:
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return float(properties.Mass())


def area(shape: TopoDS_Shape) -> float:
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, properties)
    return float(properties.Mass())


def as_trimesh(shape: TopoDS_Shape, tolerance: float = 0.02) -> trimesh.Trimesh:
    """A shape meshed to a chord error, mm."""
    mesh = meshed(shape, tolerance)
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


def manifold(shape: TopoDS_Shape, tolerance: float = 0.005) -> Manifold:
    """A shape for booleans of meshes."""
    mesh = meshed(shape, tolerance)
    return Manifold(Mesh64(mesh.vertices, mesh.triangles.astype(np.uint64)))


def cylinders(shape: TopoDS_Shape) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """A point on the axis, its direction and the radius of each round face."""
    found = []
    for face in faces(shape):
        surface = BRep_Tool.Surface_s(face)
        if isinstance(surface, Geom_CylindricalSurface):
            axis = surface.Cylinder().Axis()
            point, direction = (
                np.array([at.X(), at.Y(), at.Z()]) for at in (axis.Location(), axis.Direction())
            )
            found.append((point, direction, surface.Radius()))
    return found


def read_mesh(path: Path) -> trimesh.Trimesh:
    """Read an STL or 3MF as one mesh with merged vertices."""
    if path.suffix == ".3mf":
        return trimesh.Trimesh(*read_3mf(path), process=False)
    return trimesh.load_mesh(path)


def read_3mf(path: Path) -> tuple[np.ndarray, np.ndarray]:
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(path))
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    part = objects.GetCurrentMeshObject()
    vertices = np.array([list(v.Coordinates) for v in part.GetVertices()])
    triangles = np.array([list(t.Indices) for t in part.GetTriangleIndices()])
    assert not objects.MoveNext()
    return vertices, triangles


def segment_distances(start: np.ndarray, end: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distances (s, k) of points (k, 3) from segments (s, 3)."""
    along, to = (end - start)[:, None], points - start[:, None]
    share = np.clip((to * along).sum(axis=-1) / (along**2).sum(axis=-1), 0, 1)
    distances: np.ndarray = np.linalg.norm(to - share[..., None] * along, axis=-1)
    return distances
