"""Solids by revolution, extrusion and booleans: a thin layer over the kernel.

Booleans take lists: one general fuse of many bodies is faster than one after the other.
"""

import errno
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TYPE_CHECKING

import numpy as np
from OCP.BinTools import BinTools
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepAlgoAPI import (
    BRepAlgoAPI_BooleanOperation,
    BRepAlgoAPI_Common,
    BRepAlgoAPI_Cut,
    BRepAlgoAPI_Fuse,
)
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeSolid,
    BRepBuilderAPI_MakeVertex,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Sewing,
    BRepBuilderAPI_Transform,
)
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepClass3d import BRepClass3d
from OCP.BRepLib import BRepLib
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeRevol,
    BRepPrimAPI_MakeSphere,
)
from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Sphere
from OCP.gp import gp_Ax1, gp_Ax2, gp_Circ, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_ShapeEnum,
    TopAbs_SOLID,
    TopAbs_VERTEX,
    TopAbs_WIRE,
)
from OCP.TopExp import TopExp
from OCP.TopoDS import (
    TopoDS,
    TopoDS_Edge,
    TopoDS_Face,
    TopoDS_Shape,
    TopoDS_Solid,
    TopoDS_Vertex,
    TopoDS_Wire,
)
from OCP.TopTools import TopTools_IndexedMapOfShape, TopTools_ListOfShape

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.core.geometry.vectors import unit
from tbcad.errors import InputError
from tbcad.types import Floats

if TYPE_CHECKING:
    from build123d import Part
    from cadquery import Workplane

ORIGIN, UP = gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)
SAME_MM = 1e-6  # with the kernel's own 1e-7 a fuse of many bodies loses some of them silently


def polygon(points: Floats) -> TopoDS_Face:
    """Plane face inside a closed polygon (n, 3), its normal by the right-hand rule."""
    return BRepBuilderAPI_MakeFace(_closed_wire(points), True).Face()


def _closed_wire(points: Floats) -> TopoDS_Wire:
    wire = BRepBuilderAPI_MakePolygon()
    for point in points.tolist():
        wire.Add(gp_Pnt(*point))
    wire.Close()
    return wire.Wire()


def slot_face(middle: Floats, step: Floats, radius: float, normal: Floats) -> TopoDS_Face:
    """Plane face between two half circles about the points (3,) a step from its middle, mm."""
    wire, across = BRepBuilderAPI_MakeWire(), radius * unit(np.cross(normal, step))
    for to_end, side in ((step, across), (-step, -across)):
        axes = gp_Ax2(_point(middle + to_end), gp_Dir(*normal.tolist()), gp_Dir(*to_end.tolist()))
        half = BRepBuilderAPI_MakeEdge(gp_Circ(axes, radius), -np.pi / 2, np.pi / 2)
        wire.Add(half.Edge())
        ends = (_point(middle + to_end + side), _point(middle - to_end + side))
        wire.Add(BRepBuilderAPI_MakeEdge(*ends).Edge())
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face()


def _point(at: Floats) -> gp_Pnt:
    return gp_Pnt(*at.tolist())


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
    frame = gp_Ax2(_point(start), gp_Dir(*axis.tolist()))
    return BRepPrimAPI_MakeCylinder(frame, radius, length).Shape()


def sphere(centre: Floats, radius: float) -> TopoDS_Solid:
    """A ball about a point (3,), mm."""
    return one_solid("sphere", BRepPrimAPI_MakeSphere(_point(centre), radius).Shape())


def pyramid(apex: Floats, corners: Floats) -> TopoDS_Solid:
    """The pyramid between a point (3,) and a plane polygon (n, 3), mm."""
    loft = BRepOffsetAPI_ThruSections(True, True)
    loft.AddVertex(BRepBuilderAPI_MakeVertex(_point(apex)).Vertex())
    loft.AddWire(_closed_wire(corners))
    return one_solid("pyramid", loft.Shape())


def polyhedron(facets: Iterable[Floats]) -> TopoDS_Solid:
    """The solid within plane facets (n, 3), in any order and sense; equal corners are one, mm."""
    sewing = BRepBuilderAPI_Sewing(SAME_MM)
    for facet in facets:
        sewing.Add(polygon(facet))
    sewing.Perform()
    solid = BRepBuilderAPI_MakeSolid(TopoDS.Shell_s(sewing.SewedShape())).Solid()
    BRepLib.OrientClosedSolid_s(solid)
    return solid


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
    # Only spares time: faces come in the same order, a test compares the bytes. Threads of the
    # kernel would take a third more processor time, and the other core has work.
    operation.SetUseOBB(True)
    operation.SetToFillHistory(False)
    operation.Build()
    if not operation.IsDone():
        raise InvalidSolidError("the kernel cannot join or cut these solids")
    return operation.Shape()


def to_bytes(shape: TopoDS_Shape) -> bytes:
    """A shape as bytes from which it can be read again exactly; OSError: there is no room."""
    with NamedTemporaryFile(prefix="tbcad-") as file:  # a BytesIO loses large shapes
        if not BinTools.Write_s(shape, file.name):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), file.name)
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


def vertices(shape: TopoDS_Shape) -> list[TopoDS_Vertex]:
    """All vertices of a shape, each once."""
    return [TopoDS.Vertex_s(vertex) for vertex in _parts(shape, TopAbs_VERTEX)]


def wires(face: TopoDS_Face) -> list[TopoDS_Wire]:
    """The closed outlines of a face."""
    return [TopoDS.Wire_s(wire) for wire in _parts(face, TopAbs_WIRE)]


def reversed_faces(faces: Iterable[TopoDS_Face]) -> list[TopoDS_Face]:
    """The same faces with the material on their other side."""
    return [TopoDS.Face_s(face.Reversed()) for face in faces]


def on_sphere(face: TopoDS_Face) -> bool:
    """Whether a face is on a sphere."""
    return bool(BRepAdaptor_Surface(face).GetType() == GeomAbs_Sphere)


def cylinder_radius(face: TopoDS_Face) -> float:
    """Radius of the cylinder that a face is on, mm; 0 for other faces."""
    surface = BRepAdaptor_Surface(face)
    return surface.Cylinder().Radius() if surface.GetType() == GeomAbs_Cylinder else 0.0


def _parts(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return (found.FindKey(k) for k in range(1, found.Extent() + 1))


def one_solid(name: str, shape: TopoDS_Shape) -> TopoDS_Solid:
    """The one closed, valid solid that a shape must be; else InvalidSolidError."""
    bodies = solids(shape)
    if len(bodies) != 1:
        raise InvalidSolidError(f"{name}: {len(bodies)} solids where one should be")
    if not BRepCheck_Analyzer(bodies[0]).IsValid():
        raise InvalidSolidError(f"{name}: the kernel's check finds the solid invalid")
    return bodies[0]


def without_cavities(solid: TopoDS_Solid) -> TopoDS_Solid:
    """The solid within the outermost faces: no printer could empty crumbs of air between bodies."""
    return BRepBuilderAPI_MakeSolid(BRepClass3d.OuterShell_s(solid)).Solid()


def as_part(label: str, shape: TopoDS_Shape) -> "Part":
    """Return a solid of the kernel as a build123d part with a label; both share the geometry."""
    from build123d import Part, Solid  # takes a second, and nothing else here needs it

    part = Part([Solid(shape)])
    part.label = label
    return part


def as_workplane(part: "Part") -> "Workplane":
    """A part as a cadquery workplane, tagged with its label; InputError without cadquery."""
    try:
        from cadquery import Shape, Workplane
    except ImportError:
        raise InputError("cadquery is not installed: pip install 'tbcad[cadquery]'") from None
    shapes = [Shape.cast(solid.wrapped) for solid in part.solids()]
    return Workplane().newObject(shapes).tag(part.label or "part")
