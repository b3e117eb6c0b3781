"""Views of a solid: its edges on a plane, visible and hidden, as lines, arcs and chains of points.

By the kernel's exact removal of hidden lines (HLRBRep, after Bouma and others). Edges where two
faces go smoothly into each other are left out, as ISO 128 allows.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Section
from OCP.BRepLib import BRepLib
from OCP.GCPnts import GCPnts_TangentialDeflection
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line
from OCP.gp import gp_Ax2, gp_Dir, gp_Pln, gp_Pnt
from OCP.HLRAlgo import HLRAlgo_Projector
from OCP.HLRBRep import HLRBRep_Algo, HLRBRep_HLRToShape
from OCP.TopoDS import TopoDS_Edge, TopoDS_Shape

from tbcad.cad.kernel.solids import edges
from tbcad.types import Floats

Place: TypeAlias = tuple[float, float]
Shape: TypeAlias = TopoDS_Shape  # any shape of the kernel
FIRST = np.eye(3)
ANGLE, CHORD_MM = 0.1, 0.01  # of chains of points: turn from one to the next, rad, and deviation
DIGITS = 5  # of mm; equal edges are drawn once
LEAST_MM = 1e-3  # shorter ones are left out
FULL_DEG = 360.0


class Segment(NamedTuple):
    """A straight line."""

    start: Place
    end: Place


class Round(NamedTuple):
    """An arc counterclockwise between two angles; a full circle from 0 to 360 degrees."""

    centre: Place
    radius: float
    start_deg: float
    end_deg: float


class Chain(NamedTuple):
    """Points of a curve."""

    points: tuple[Place, ...]


Curve: TypeAlias = Segment | Round | Chain


@dataclass(frozen=True)
class Projection:
    """Edges of a solid in a view, x to the right and y up, mm."""

    visible: tuple[Curve, ...]  # edges and outlines in front
    hidden: tuple[Curve, ...]  # those behind the solid


def project(shape: TopoDS_Shape, axes: Floats, *, hidden: bool = True) -> Projection:
    """Project a shape (mm) on axes: right, up and toward the eye in its frame, as rows, (3, 3)."""
    algorithm = HLRBRep_Algo()
    algorithm.Add(shape, 0)
    plane = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(*axes[2].tolist()), gp_Dir(*axes[0].tolist()))
    algorithm.Projector(HLRAlgo_Projector(plane))
    algorithm.Update()
    algorithm.Hide()
    drawn = HLRBRep_HLRToShape(algorithm)
    front = _unique(_of_shapes((drawn.VCompound(), drawn.OutLineVCompound())))
    other = (drawn.HCompound(), drawn.OutLineHCompound()) if hidden else ()
    behind = _unique(_of_shapes(other))
    return Projection(front, tuple(one for one in behind if one not in set(front)))


def section(shape: TopoDS_Shape, axes: Floats, level: float) -> tuple[Curve, ...]:
    """The edges in which a plane cuts a shape at a level (mm) on the last axis, as of `project`."""
    normal = gp_Dir(*axes[2].tolist())
    tool = BRepAlgoAPI_Section(shape, gp_Pln(gp_Pnt(*(level * axes[2]).tolist()), normal), False)
    tool.Build()
    return _unique(_flat(edge, axes) for edge in edges(tool.Shape()))


def _of_shapes(shapes: Iterable[TopoDS_Shape | None]) -> Iterator[Curve | None]:
    for shape in shapes:
        if shape is None or shape.IsNull():
            continue
        BRepLib.BuildCurves3d_s(shape)
        yield from (_flat(edge, FIRST) for edge in edges(shape))


def _unique(curves: Iterable[Curve | None]) -> tuple[Curve, ...]:
    """Each once, in an order that does not depend on the kernel's."""
    kept = {one for one in curves if one is not None}
    return tuple(sorted(kept, key=lambda one: (type(one).__name__, repr(tuple(one)))))


def _flat(edge: TopoDS_Edge, axes: Floats) -> Curve | None:
    """An edge in the plane of two axes; None where nothing is left of it."""
    curve = BRepAdaptor_Curve(edge)
    kind, first, last = curve.GetType(), curve.FirstParameter(), curve.LastParameter()
    if kind == GeomAbs_Line:
        ends = sorted(_place(curve.Value(at), axes) for at in (first, last))
        return Segment(*ends) if math.dist(*ends) > LEAST_MM else None
    if kind == GeomAbs_Circle:
        return _round(curve, axes)
    steps = GCPnts_TangentialDeflection(curve, first, last, ANGLE, CHORD_MM)
    points = [_place(steps.Value(k), axes) for k in range(1, steps.NbPoints() + 1)]
    if points[-1] < points[0]:
        points.reverse()
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    return Chain(tuple(points)) if length > LEAST_MM else None


def _round(curve: BRepAdaptor_Curve, axes: Floats) -> Round | None:
    """An arc in the plane: its axis is the third, or opposite to it."""
    circle, radius = curve.Circle(), curve.Circle().Radius()
    first, last = curve.FirstParameter(), curve.LastParameter()
    if (last - first) * radius < LEAST_MM:
        return None
    centre = _place(circle.Location(), axes)
    if last - first > 2 * np.pi - LEAST_MM:
        return Round(centre, round(radius, DIGITS), 0.0, FULL_DEG)
    direction = circle.Axis().Direction()
    if np.dot(_numbers(direction), axes[2]) < 0:
        first, last = last, first
    start, end = (_angle(_place(curve.Value(at), axes), centre) for at in (first, last))
    return Round(centre, round(radius, DIGITS), start, end)


def _angle(point: Place, centre: Place) -> float:
    x, y = point[0] - centre[0], point[1] - centre[1]
    return round(float(np.degrees(np.arctan2(y, x))) % FULL_DEG, DIGITS)


def _place(point: gp_Pnt, axes: Floats) -> Place:
    x, y = (axes[:2] @ _numbers(point)).tolist()
    return round(x, DIGITS) + 0.0, round(y, DIGITS) + 0.0


def _numbers(point: gp_Pnt | gp_Dir) -> Floats:
    return np.array([point.X(), point.Y(), point.Z()])
