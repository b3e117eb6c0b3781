"""Solids by revolution, extrusion and booleans, and their meshes: a thin layer over the kernel.

Booleans take lists: one general fuse of many bodies is faster than one after the other.
"""

import multiprocessing
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
from manifold3d import Manifold, Mesh64, OpType
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepAlgoAPI import (
    BRepAlgoAPI_BooleanOperation,
    BRepAlgoAPI_Common,
    BRepAlgoAPI_Cut,
    BRepAlgoAPI_Fuse,
)
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_Copy,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeSolid,
    BRepBuilderAPI_MakeVertex,
    BRepBuilderAPI_Transform,
)
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepClass3d import BRepClass3d
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
)
from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_REVERSED,
    TopAbs_ShapeEnum,
    TopAbs_SOLID,
    TopAbs_VERTEX,
)
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Solid, TopoDS_Wire
from OCP.TopTools import TopTools_IndexedMapOfShape, TopTools_ListOfShape

from tbcad.cad.brep import InvalidSolidError
from tbcad.cad.mesh import Mesh
from tbcad.types import Floats, Ints

ORIGIN, UP = gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)
# Facets of cylinders and cones: no coarser than a turn of this angle (radians).
ANGLE = 0.2
# With the kernel's own 1e-7 a fuse of many bodies loses some of them now and then, silently.
SAME_MM = 1e-6
# Booleans of more shapes than this are done in threads.
FEW = 8


@dataclass(frozen=True)
class SolidProperties:
    """What integrals over a homogeneous solid give.

    Attributes:
        volume: mm^3.
        area: of the surface, mm^2.
        centroid: x, y and z, mm.
    """

    volume: float
    area: float
    centroid: tuple[float, float, float]

    def mirrored(self) -> "SolidProperties":
        """Those of the mirror image in the plane x = 0."""
        x, y, z = self.centroid
        return SolidProperties(self.volume, self.area, (-x, y, z))


def polygon(points: Floats) -> TopoDS_Face:
    """Plane face inside a closed polygon (n, 3), its normal by the right-hand rule."""
    return BRepBuilderAPI_MakeFace(_closed_wire(points), True).Face()


def _closed_wire(points: Floats) -> TopoDS_Wire:
    wire = BRepBuilderAPI_MakePolygon()
    for point in points.tolist():
        wire.Add(gp_Pnt(*point))
    wire.Close()
    return wire.Wire()


def revolved(face: TopoDS_Face, angle: float = 2 * np.pi) -> TopoDS_Shape:
    """Solid that a face sweeps when turned about z."""
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(ORIGIN, UP), angle).Shape()


def revolved_polygon(profile: Floats, start: float, angle: float) -> TopoDS_Shape:
    """Solid of revolution about z of a polygon (n, 2) of (z, r), between two azimuths."""
    z, r = profile.T
    at = np.stack([r * np.cos(start), r * np.sin(start), z], axis=1)
    return revolved(polygon(at), angle)


def prism(face: TopoDS_Face, along: Floats) -> TopoDS_Shape:
    """Solid that a face sweeps when moved."""
    return BRepPrimAPI_MakePrism(face, gp_Vec(*along.tolist())).Shape()


def cylinder(start: Floats, axis: Floats, radius: float, length: float) -> TopoDS_Shape:
    """Solid cylinder from a point along a unit axis."""
    frame = gp_Ax2(gp_Pnt(*start.tolist()), gp_Dir(*axis.tolist()))
    return BRepPrimAPI_MakeCylinder(frame, radius, length).Shape()


def sphere(centre: Floats, radius: float) -> TopoDS_Solid:
    """A ball about a point (3,), mm."""
    return one_solid("sphere", BRepPrimAPI_MakeSphere(gp_Pnt(*centre.tolist()), radius).Shape())


def pyramid(apex: Floats, corners: Floats) -> TopoDS_Solid:
    """The pyramid between a point (3,) and a plane polygon (n, 3), mm."""
    loft = BRepOffsetAPI_ThruSections(True, True)
    loft.AddVertex(BRepBuilderAPI_MakeVertex(gp_Pnt(*apex.tolist())).Vertex())
    loft.AddWire(_closed_wire(corners))
    return one_solid("pyramid", loft.Shape())


def moved(shape: TopoDS_Shape, axes: Floats, origin: Floats) -> TopoDS_Shape:
    """Rigid move: axes (3, 3) are what x, y and z become, as rows; origin what 0 becomes."""
    matrix = np.column_stack([axes.T, origin])
    move = gp_Trsf()
    move.SetValues(*matrix.ravel().tolist())
    return BRepBuilderAPI_Transform(shape, move, True).Shape()


def fused(shapes: Sequence[TopoDS_Shape], same: float = SAME_MM) -> TopoDS_Shape:
    """Union of shapes; what is nearer than this (mm) is taken for the same."""
    return _boolean(BRepAlgoAPI_Fuse(), shapes[:1], shapes[1:], same)


def cut(shape: TopoDS_Shape, tools: Sequence[TopoDS_Shape], same: float = SAME_MM) -> TopoDS_Shape:
    """A shape without others; what is nearer than this (mm) is taken for the same."""
    return _boolean(BRepAlgoAPI_Cut(), [shape], tools, same)


def common(one: TopoDS_Shape, other: TopoDS_Shape) -> TopoDS_Shape:
    """What two shapes have in common."""
    return _boolean(BRepAlgoAPI_Common(), [one], [other], SAME_MM)


def _boolean(
    operation: BRepAlgoAPI_BooleanOperation,
    first: Sequence[TopoDS_Shape],
    second: Sequence[TopoDS_Shape],
    same: float,
) -> TopoDS_Shape:
    if not second:
        return first[0]
    operation.SetArguments(_list(first))
    operation.SetTools(_list(second))
    operation.SetFuzzyValue(same)
    # Both only spare time: faces come in the same order, tests compare the bytes.
    operation.SetRunParallel(len(first) + len(second) > FEW and _has_threads())
    operation.SetUseOBB(True)
    operation.SetToFillHistory(False)
    operation.Build()
    if not operation.IsDone():
        raise InvalidSolidError("the kernel cannot join or cut these solids")
    return operation.Shape()


def _has_threads() -> bool:
    """Whether the kernel's threads are there: a copy of a process would wait for them for ever."""
    return multiprocessing.parent_process() is None


def to_bytes(shape: TopoDS_Shape) -> bytes:
    """A shape as bytes from which it can be read again exactly."""
    with NamedTemporaryFile(prefix="tbcad-") as file:  # a BytesIO loses large shapes
        BinTools.Write_s(shape, file.name)
        return Path(file.name).read_bytes()


def from_bytes(data: bytes) -> TopoDS_Shape:
    """A shape from its bytes."""
    shape = TopoDS_Shape()
    with NamedTemporaryFile(prefix="tbcad-") as file:
        Path(file.name).write_bytes(data)
        BinTools.Read_s(shape, file.name)
    return TopoDS.Solid_s(shape) if shape.ShapeType() == TopAbs_SOLID else shape


def _list(shapes: Sequence[TopoDS_Shape]) -> TopTools_ListOfShape:
    result = TopTools_ListOfShape()
    for shape in shapes:
        result.Append(shape)
    return result


def solids(shape: TopoDS_Shape) -> list[TopoDS_Solid]:
    """All solids of a shape, each once."""
    return [TopoDS.Solid_s(solid) for solid in _parts(shape, TopAbs_SOLID)]


def faces(shape: TopoDS_Shape) -> list[TopoDS_Face]:
    """All faces of a shape, each once."""
    return [TopoDS.Face_s(face) for face in _parts(shape, TopAbs_FACE)]


def edges(shape: TopoDS_Shape) -> list[TopoDS_Edge]:
    """All edges of a shape, each once."""
    return [TopoDS.Edge_s(edge) for edge in _parts(shape, TopAbs_EDGE)]


def cylinder_radius(face: TopoDS_Face) -> float:
    """Radius of the cylinder that a face is on, mm; 0 for other faces."""
    surface = BRepAdaptor_Surface(face)
    return surface.Cylinder().Radius() if surface.GetType() == GeomAbs_Cylinder else 0.0


def _parts(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return (found.FindKey(k) for k in range(1, found.Extent() + 1))


def one_solid(name: str, shape: TopoDS_Shape) -> TopoDS_Solid:
    """The one closed solid that a shape must be.

    Raises:
        InvalidSolidError: when it is several, or the kernel's check finds it invalid.
    """
    bodies = solids(shape)
    if len(bodies) != 1:
        raise InvalidSolidError(f"{name}: {len(bodies)} solids where one should be")
    if not BRepCheck_Analyzer(bodies[0]).IsValid():
        raise InvalidSolidError(f"{name}: the kernel's check finds the solid invalid")
    return bodies[0]


def without_cavities(solid: TopoDS_Solid) -> TopoDS_Solid:
    """The solid within the outermost faces.

    Bodies that touch can close in a crumb of air between them, which no printer could empty.
    """
    return BRepBuilderAPI_MakeSolid(BRepClass3d.OuterShell_s(solid)).Solid()


def volume(shape: TopoDS_Shape) -> float:
    """Volume, mm^3."""
    inside = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, inside)
    return float(inside.Mass())


def properties(shape: TopoDS_Shape) -> SolidProperties:
    """Volume, area and centroid by the kernel's integrals, which take seconds for a shell."""
    inside, surface = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, inside)
    BRepGProp.SurfaceProperties_s(shape, surface)
    centre = inside.CentreOfMass()
    return SolidProperties(inside.Mass(), surface.Mass(), (centre.X(), centre.Y(), centre.Z()))


@dataclass(frozen=True)
class FaceIntegrals:
    """Integrals over faces, by which they add up to those of a solid.

    Attributes:
        origin: any point near the faces, mm, (3,): the nearer, the less errors of the kernel count.
        volume: between the origin and the faces, mm^3.
        volume_moment: of the distance from the origin over that volume, mm^4, (3,).
        area: mm^2.
    """

    origin: Floats
    volume: float
    volume_moment: Floats
    area: float

    def __add__(self, other: "FaceIntegrals") -> "FaceIntegrals":
        """Those of both together; they have the same origin."""
        return FaceIntegrals(
            self.origin,
            self.volume + other.volume,
            self.volume_moment + other.volume_moment,
            self.area + other.area,
        )

    @property
    def properties(self) -> SolidProperties:
        """Those of the solid that the faces close."""
        x, y, z = (self.origin + self.volume_moment / self.volume).tolist()
        return SolidProperties(self.volume, self.area, (x, y, z))


def mean_corner(shape: TopoDS_Shape) -> Floats:
    """Mean of a shape's corners, mm, (3,)."""
    corners = map(TopoDS.Vertex_s, _parts(shape, TopAbs_VERTEX))
    points = np.array([BRep_Tool.Pnt_s(corner).Coord() for corner in corners])
    return np.asarray(points.mean(axis=0))


def face_integrals(face: TopoDS_Face, origin: Floats) -> FaceIntegrals:
    """Integrals over a face by the kernel."""
    inside, surface = BRepGProp_Vinert(), GProp_GProps()
    inside.SetLocation(gp_Pnt(*origin.tolist()))
    inside.Perform(BRepGProp_Face(face), BRepGProp_Domain(face))
    BRepGProp.SurfaceProperties_s(face, surface)
    moment = inside.Mass() * (np.array(inside.CentreOfMass().Coord()) - origin)
    return FaceIntegrals(origin, inside.Mass(), moment, surface.Mass())


def plane_faces(shape: TopoDS_Shape) -> tuple[Floats, Floats]:
    """Centres (f, 3) and areas (f,) of all plane faces of a shape, mm and mm^2."""
    centre, area = [], []
    for face in faces(shape):
        if BRepAdaptor_Surface(face).GetType() == GeomAbs_Plane:
            surface = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, surface)
            centre.append(surface.CentreOfMass().Coord())
            area.append(surface.Mass())
    return np.array(centre).reshape(-1, 3), np.array(area)


def volume_by_meshes(
    bodies: Sequence[TopoDS_Shape], tools: Sequence[TopoDS_Shape], tolerance: float
) -> float:
    """Volume of a union without tools, by booleans of meshes: another way to the same figure."""
    union = Manifold.batch_boolean([_manifold(one, tolerance) for one in bodies], OpType.Add)
    removed = [_manifold(one, tolerance) for one in tools]
    return float(Manifold.batch_boolean([union, *removed], OpType.Subtract).volume())


def volume_by_cut_mesh(
    shape: TopoDS_Shape, planes: Floats, tools: Sequence[TopoDS_Shape], tolerance: float
) -> float:
    """Volume of a shape below planes (h, 4), unit normal and level, and without tools."""
    net = _manifold(shape, tolerance)
    for *normal, level in (-planes).tolist():
        net = net.trim_by_plane(normal, level)
    removed = [_manifold(one, tolerance) for one in tools]
    return float(Manifold.batch_boolean([net, *removed], OpType.Subtract).volume())


def _manifold(shape: TopoDS_Shape, tolerance: float) -> Manifold:
    net = meshed(shape, tolerance)
    return Manifold(Mesh64(net.vertices, net.triangles.astype(np.uint64)))


def meshed(shape: TopoDS_Shape, tolerance: float, angle: float = ANGLE) -> Mesh:
    """Mesh by the kernel's mesher; corners that faces share are one, degenerate facets dropped.

    Args:
        shape: a solid; its own facets are left alone.
        tolerance: largest distance of facets from the surface, mm.
        angle: largest turn of the surface along a facet's edge, radians.
    """
    copy = BRepBuilderAPI_Copy(shape, True, False).Shape()
    BRepMesh_IncrementalMesh(copy, tolerance, False, angle, False)
    points, triangles, start = [], [], 0
    for face in faces(copy):
        corner, facet = _facets(face)
        points.append(corner)
        triangles.append(facet + start)
        start += len(corner)
    return _joined(np.concatenate(points), np.concatenate(triangles))


def _facets(face: TopoDS_Face) -> tuple[Floats, Ints]:
    place = TopLoc_Location()
    net = BRep_Tool.Triangulation_s(face, place)
    if net is None:
        raise InvalidSolidError("the kernel cannot mesh a face")
    nodes = (net.Node(i) for i in range(1, net.NbNodes() + 1))
    if not place.IsIdentity():
        move = place.Transformation()
        nodes = (node.Transformed(move) for node in nodes)
    corners = [node.Coord() for node in nodes]
    facets = [net.Triangle(i).Get() for i in range(1, net.NbTriangles() + 1)]
    triangle = np.array(facets, dtype=np.int64).reshape(-1, 3) - 1
    if face.Orientation() == TopAbs_REVERSED:
        triangle = triangle[:, ::-1]
    return np.array(corners), triangle


def _joined(points: Floats, triangles: Ints) -> Mesh:
    """Corners that agree to a nanometre become one; facets that lose a corner go."""
    _, first, of = np.unique(np.round(points, 6), axis=0, return_index=True, return_inverse=True)
    return without_degenerate(points[first], of.reshape(-1)[triangles])


def without_degenerate(vertices: Floats, triangles: Ints) -> Mesh:
    """A mesh without the facets of which two corners became one."""
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return Mesh(vertices, triangles[whole])
