"""A STEP file as the CAD kernel reads it; no other module of the verification imports a kernel.

It runs in a process of its own: native code that reads a foreign file may hang or crash.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepClass import BRepClass_FaceClassifier
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools
from OCP.GeomAbs import GeomAbs_Plane, GeomAbs_Sphere
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt, gp_Pnt2d
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.Message import Message, Message_Gravity
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance, ShapeAnalysis_Surface
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_FORWARD,
    TopAbs_IN,
    TopAbs_ON,
    TopAbs_SHELL,
    TopAbs_SOLID,
)
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape

Row = dict[str, Any]

MAXIMUM = 1  # of all tolerances: a mode of the kernel
NEAR_MM = 1e-6  # of a point to a face that it is on
FULL_TURN, SLACK = 2 * np.pi, 1e-9
FAR_MM = 1e4  # farther than any part, near enough for the digits


def read_solid(path: Path) -> Row:
    """Counts, measures and faces of a STEP file, as plain numbers and texts; mm.

    Raises:
        ValueError: the kernel cannot read it, or finds no shape in it.
    """
    shape = _transferred(path)
    volume = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume)
    return {
        "solids": _count(shape, TopAbs_SOLID),
        "shells": _count(shape, TopAbs_SHELL),
        "open_edges": _open_edges(shape),
        "valid": bool(BRepCheck_Analyzer(shape).IsValid()),
        "gap": ShapeAnalysis_ShapeTolerance().Tolerance(shape, MAXIMUM),
        "volume": volume.Mass(),
        "centroid": _point(volume.CentreOfMass()),
        "box": _box(shape),
        "faces": [_face(TopoDS.Face_s(face)) for face in _each(shape, TopAbs_FACE)],
    }


def _transferred(path: Path) -> TopoDS_Shape:
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Alarm)
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise ValueError("the kernel cannot read it as STEP")
    if reader.TransferRoots() < 1:
        raise ValueError("the kernel finds no shape in it")
    return reader.OneShape()


def _each(shape: TopoDS_Shape, kind: Any) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _count(shape: TopoDS_Shape, kind: Any) -> int:
    return sum(1 for _ in _each(shape, kind))


def _open_edges(shape: TopoDS_Shape) -> int:
    """Edges without exactly two sides; a seam has both its own, and a pole is a point."""
    sides = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, sides)
    return sum(
        sides.FindFromIndex(k).Extent() != 2
        and not BRep_Tool.Degenerated_s(TopoDS.Edge_s(sides.FindKey(k)))
        for k in range(1, sides.Extent() + 1)
    )


def _face(face: TopoDS_Face) -> Row:
    measured = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, measured)
    return {
        "area": measured.Mass(),
        "centroid": _point(measured.CentreOfMass()),
        **_surface(face),
    }


def _surface(face: TopoDS_Face) -> Row:
    """Kind and figures; `outward`: whether the natural normal points out of the solid."""
    surface = BRepAdaptor_Surface(face)
    forward = face.Orientation() == TopAbs_FORWARD
    if surface.GetType() == GeomAbs_Sphere:
        sphere = surface.Sphere()
        return {
            "kind": "sphere",
            "point": _point(sphere.Location()),
            "radius": sphere.Radius(),
            "outward": forward == bool(sphere.Position().Direct()),
        }
    if surface.GetType() == GeomAbs_Plane:
        plane = surface.Plane()
        axis, sign = plane.Axis().Direction(), 1 if forward == plane.Position().Direct() else -1
        return {
            "kind": "plane",
            "point": _point(plane.Location()),
            "axis": [axis.X(), axis.Y(), axis.Z()],
            "normal": [sign * axis.X(), sign * axis.Y(), sign * axis.Z()],
        }
    return {"kind": "other"}


def _point(point: gp_Pnt) -> list[float]:
    return [point.X(), point.Y(), point.Z()]


def _box(shape: TopoDS_Shape) -> list[list[float]]:
    """Minimum and maximum x, y, z, from the distances to far walls on all six sides.

    The kernel's own boxes are those of whole surfaces, too large for a patch of a spheroid.
    """
    maximum = [_reach(shape, *axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    minimum = [-_reach(shape, *axis) for axis in ((-1, 0, 0), (0, -1, 0), (0, 0, -1))]
    return [minimum, maximum]


def _reach(shape: TopoDS_Shape, x: int, y: int, z: int) -> float:
    """The shape's extreme along an axis, mm."""
    wall = gp_Pln(gp_Pnt(x * FAR_MM, y * FAR_MM, z * FAR_MM), gp_Dir(x, y, z))
    face = BRepBuilderAPI_MakeFace(wall, -FAR_MM, FAR_MM, -FAR_MM, FAR_MM).Face()
    distance = BRepExtrema_DistShapeShape(shape, face)
    if not distance.IsDone():
        return float("nan")
    extreme: float = FAR_MM - distance.Value()
    return max([extreme, *_tops(shape, np.array([x, y, z], dtype=np.float64), extreme)])


def _tops(shape: TopoDS_Shape, axis: NDArray[np.float64], beyond: float) -> Iterator[float]:
    """Extremes of spheres that are beyond this along an axis, within their faces, mm.

    The kernel's distance to a wall sometimes misses them.
    """
    for face in map(TopoDS.Face_s, _each(shape, TopAbs_FACE)):
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() == GeomAbs_Sphere:
            sphere = surface.Sphere()
            top = np.array(_point(sphere.Location())) + sphere.Radius() * axis
            if top @ axis > beyond and _is_on(face, top):
                yield float(top @ axis)


def _is_on(face: TopoDS_Face, point: NDArray[np.float64]) -> bool:
    """Whether a point of a face's sphere is on the face: in parameters, of which u is periodic."""
    around, up = (
        ShapeAnalysis_Surface(BRep_Tool.Surface_s(face))
        .ValueOfUV(gp_Pnt(*point.tolist()), NEAR_MM)
        .Coord()
    )
    low, high, _, _ = BRepTools.UVBounds_s(face)
    turns = np.arange(
        np.ceil((low - around) / FULL_TURN - SLACK), (high - around) / FULL_TURN + SLACK
    )
    return any(
        BRepClass_FaceClassifier(face, gp_Pnt2d(around + k * FULL_TURN, up), NEAR_MM).State()
        in (TopAbs_IN, TopAbs_ON)
        for k in turns.tolist()
    )
