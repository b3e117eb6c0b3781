"""Views of a solid on a sheet, in first-angle projection (ISO 5456-2), and its edges in them.

By the kernel's exact removal of hidden lines (HLRBRep, after Bouma and others). Edges where two
faces go smoothly into each other are left out, as ISO 128 allows.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias

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

from tbcad.cad.drafting.sheet import placed
from tbcad.cad.formats.entities import Arc, Circle, Entity, Layer, Line, Point, Polyline, simple
from tbcad.cad.kernel.solids import edges
from tbcad.types import Floats

Shape: TypeAlias = TopoDS_Shape  # any shape of the kernel
Curve: TypeAlias = Line | Circle | Arc | Polyline
# Right, up and toward the eye in the part's frame: from in front, from above, from the left.
FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
ABOVE = np.eye(3)
LEFT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
CHORDS = 17  # points that stand for an arc
ANGLE, CHORD_MM = 0.1, 0.01  # of points of curves: turn from one to the next, rad, and deviation
DIGITS, CURVE_DIGITS = 5, 3  # of mm, equal edges are drawn once; of points of other curves
LEAST_MM = 1e-3  # shorter ones are left out
FULL_DEG = 360.0


def isometric() -> Floats:
    """Right, up and toward the eye of an isometric view from the front, left and above, (3, 3)."""
    eye = np.array([-1.0, -1.0, 1.0]) / np.sqrt(3)
    right = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    return np.stack([right, np.cross(eye, right), eye])


@dataclass(frozen=True)
class Projection:
    """Edges of a solid in a view, x to the right and y up, mm."""

    visible: tuple[Curve, ...]  # edges and outlines in front
    hidden: tuple[Curve, ...]  # those behind the solid


@dataclass(frozen=True)
class View:
    """A view and its place."""

    axes: Floats  # right, up and toward the eye in the part's frame, as rows, (3, 3)
    origin: Point  # of the part's coordinates on paper, mm
    scale: float  # of the view

    def at(self, point: Floats) -> Point:
        """Where a point of the part (mm, (3,)) is on paper, mm."""
        x, y = (self.scale * self.axes[:2] @ point).tolist()
        return self.origin[0] + x, self.origin[1] + y

    def drawn(self, projection: Projection) -> list[Entity]:
        """The edges on paper, the hidden ones below."""
        return placed((*projection.hidden, *projection.visible), self.origin, self.scale)


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
    hidden_only = (one for one in behind if one not in set(front))
    return Projection(front, tuple(replace(one, layer=Layer.HIDDEN) for one in hidden_only))


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
        yield from (_flat(edge, ABOVE) for edge in edges(shape))


def _unique(curves: Iterable[Curve | None]) -> tuple[Curve, ...]:
    """Each once, in an order that does not depend on the kernel's."""
    return tuple(sorted({one for one in curves if one is not None}, key=_order))


def _order(curve: Curve) -> tuple[int, str]:
    match curve:
        case Polyline(_, corners):
            return 0, repr(corners)
        case Circle(_, centre, radius):
            return 1, repr((centre, radius, 0.0, FULL_DEG))
        case Arc(_, centre, radius, first, last):
            return 1, repr((centre, radius, first, last))
        case Line(_, start, end):
            return 2, repr((start, end))


def _flat(edge: TopoDS_Edge, axes: Floats) -> Curve | None:
    """An edge in the plane of two axes; None where nothing is left of it."""
    curve = BRepAdaptor_Curve(edge)
    kind, first, last = curve.GetType(), curve.FirstParameter(), curve.LastParameter()
    if kind == GeomAbs_Line:
        ends = sorted(_place(curve.Value(at), axes) for at in (first, last))
        return Line(Layer.CUT, *ends) if math.dist(*ends) > LEAST_MM else None
    if kind == GeomAbs_Circle:
        return _round(curve, axes)
    steps = GCPnts_TangentialDeflection(curve, first, last, ANGLE, CHORD_MM)
    points = [_place(steps.Value(k), axes) for k in range(1, steps.NbPoints() + 1)]
    if points[-1] < points[0]:
        points.reverse()
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    corners = tuple((round(x, CURVE_DIGITS), round(y, CURVE_DIGITS)) for x, y in points)
    return Polyline(Layer.CUT, corners, closed=False) if length > LEAST_MM else None


def _round(curve: BRepAdaptor_Curve, axes: Floats) -> Circle | Arc | None:
    """An arc in the plane: its axis is the third, or opposite to it."""
    circle, radius = curve.Circle(), round(curve.Circle().Radius(), DIGITS)
    first, last = curve.FirstParameter(), curve.LastParameter()
    if (last - first) * radius < LEAST_MM:
        return None
    centre = _place(circle.Location(), axes)
    if last - first > 2 * np.pi - LEAST_MM:
        return Circle(Layer.CUT, centre, radius)
    direction = circle.Axis().Direction()
    if np.dot(_numbers(direction), axes[2]) < 0:
        first, last = last, first
    start, end = (_angle(_place(curve.Value(at), axes), centre) for at in (first, last))
    return Arc(Layer.CUT, centre, radius, start, end)


def _angle(point: Point, centre: Point) -> float:
    x, y = point[0] - centre[0], point[1] - centre[1]
    return round(float(np.degrees(np.arctan2(y, x))) % FULL_DEG, DIGITS)


def _place(point: gp_Pnt, axes: Floats) -> Point:
    x, y = (axes[:2] @ _numbers(point)).tolist()
    return round(x, DIGITS) + 0.0, round(y, DIGITS) + 0.0


def _numbers(point: gp_Pnt | gp_Dir) -> Floats:
    return np.array([point.X(), point.Y(), point.Z()])


def straight(entities: Iterable[Entity]) -> list[tuple[Point, Point]]:
    """Straight pieces of what is drawn, by their ends: arcs as chords."""
    pieces: list[tuple[Point, Point]] = []
    for one in simple(entities):
        match one:
            case Line(_, start, end):
                pieces.append((start, end))
            case Polyline(_, corners):
                pieces += pairwise(corners)
            case Circle(_, centre, radius):
                pieces += pairwise(_on(centre, radius, 0.0, FULL_DEG))
            case Arc(_, centre, radius, first, last):
                pieces += pairwise(_on(centre, radius, first, first + (last - first) % FULL_DEG))
    return pieces


def _on(centre: Point, radius: float, first: float, last: float) -> list[Point]:
    """Points of an arc from one angle to another, degrees."""
    angles = np.radians(np.linspace(first, last, CHORDS))
    around = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * radius + centre
    return [(x, y) for x, y in around.tolist()]
