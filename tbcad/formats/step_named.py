"""A solid and the names of its faces, as a STEP file has them."""

from pathlib import Path
from typing import TypeAlias

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_Plane, GeomAbs_Sphere
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.StepGeom import StepGeom_Plane, StepGeom_SphericalSurface
from OCP.StepShape import StepShape_AdvancedFace
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopoDS import TopoDS, TopoDS_Face
from scipy.spatial import cKDTree

from tbcad.cad.brep import Solid
from tbcad.cad.solids import faces
from tbcad.errors import InputError
from tbcad.formats.step import StepError, kernel_settings
from tbcad.types import Floats, Ints

Place: TypeAlias = tuple[float, ...]
"""Kind, location (mm) and axis of a surface."""
PLANE, SPHERE = 1.0, 2.0
OTHER: Place = (0.0,) * 7
# Below any distance of surfaces, above what is left of a direction that is made a unit vector.
SAME = 1e-6


@kernel_settings()
def read_named_solid(path: Path) -> Solid:
    """Read a file of one solid.

    Raises:
        InputError: it cannot be read, or is not one solid.
    """
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone or reader.TransferRoots() != 1:
        raise InputError(f"{path} is no STEP file of one solid: run tbcad build again")
    shape = reader.OneShape()
    named, found = _face_entities(reader), faces(shape)
    if shape.ShapeType() != TopAbs_ShapeEnum.TopAbs_SOLID or len(found) != len(named):
        raise InputError(f"{path} is no STEP file of one solid: run tbcad build again")
    ordered = _as_in_file(
        np.array([_of_entity(one) for one in named]), np.array([_of_face(one) for one in found])
    )
    names = (one.Name().ToCString() for one in named)
    pairs = tuple((name, found[k]) for name, k in zip(names, ordered.tolist(), strict=True))
    return Solid(path.stem, TopoDS.Solid_s(shape), pairs)


def _face_entities(reader: STEPControl_Reader) -> list[StepShape_AdvancedFace]:
    model = reader.WS().Model()
    entities = (model.Value(k) for k in range(1, model.NbEntities() + 1))
    return [one for one in entities if isinstance(one, StepShape_AdvancedFace)]


def _as_in_file(file: Floats, shape: Floats) -> Ints:
    """Which of a shape's faces each face of the file is, by their places (f, 7) each.

    The kernel lets each face touch one before it: where the file does not, it changes the order.
    Those on one surface keep theirs.
    """
    tree = cKDTree(file)
    same = np.array([np.min(near) for near in tree.query_ball_point(file, SAME)])
    apart, nearest = map(np.asarray, tree.query(shape))
    found = same[nearest]
    if apart.max() > SAME or not np.array_equal(np.sort(found), np.sort(same)):
        raise StepError("the kernel reads other surfaces than the file has")
    order = np.empty(len(file), dtype=np.int64)
    order[np.argsort(same, kind="stable")] = np.argsort(found, kind="stable")
    return order


def _of_entity(face: StepShape_AdvancedFace) -> Place:
    """Kind, location and axis of a plane or sphere; of others nothing."""
    surface = face.FaceGeometry()
    if not isinstance(surface, StepGeom_Plane | StepGeom_SphericalSurface):
        return OTHER
    at, axis = surface.Position().Location(), surface.Position().Axis()
    location = (at.CoordinatesValue(k) for k in (1, 2, 3))
    kind = PLANE if isinstance(surface, StepGeom_Plane) else SPHERE
    return (kind, *location, *(axis.DirectionRatiosValue(k) for k in (1, 2, 3)))


def _of_face(face: TopoDS_Face) -> Place:
    """The same of the kernel's face."""
    surface = BRepAdaptor_Surface(face)
    if surface.GetType() == GeomAbs_Plane:
        kind, at = PLANE, surface.Plane().Position()
    elif surface.GetType() == GeomAbs_Sphere:
        kind, at = SPHERE, surface.Sphere().Position()
    else:
        return OTHER
    return (kind, *at.Location().Coord(), *at.Direction().Coord())
