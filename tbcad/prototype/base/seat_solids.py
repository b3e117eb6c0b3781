"""Bosses of the seats, and what is cut out of them: cup, pocket and path, but not the pads.

Each is built in the seat's own frame with the ball's centre at the origin and the seat's axis
along z, and then moved: a sphere whose axis is not the axis of the cut comes out invalid now and
then.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape

from tbcad.cad.solids import cut, cylinder, moved, revolved
from tbcad.prototype.base.profile import meridian
from tbcad.prototype.base.seats import Seats

# The path is narrower than the cup by this share of the cup's clearance, so that the two meet at
# an angle.
NARROWER = 0.4
POST_MM = 1.5  # of each pad into the boss
INTO_BOSS_MM = 0.3  # by which the space behind a boss begins inside of it, and is narrower
POLE_ANGLE = 0.3  # about the axis, radians: the cup's hemisphere ends here, short of its pole
ALONG = np.array([0.0, 0.0, 1.0])

Point = tuple[float, float]
"""A point (x out, z along) of the half-plane y = 0."""


def boss_solid(seats: Seats, k: int) -> TopoDS_Shape:
    """Solid boss in its own frame."""
    length = float(seats.back[k] - seats.front[k])
    return cylinder(seats.front[k] * ALONG, ALONG, float(seats.boss[k]), length)


def seat_hollow(seats: Seats, k: int, offset: float = 0.0) -> TopoDS_Shape:
    """What a ball and its magnet need, without the posts of the pads, in the seat's own frame.

    Args:
        seats: of all balls.
        k: number of the seat.
        offset: how far the pads are moved off the ball, mm.
    """
    radius, cup, pocket = float(seats.radius[k]), float(seats.cup[k]), float(seats.pocket[k])
    # Seams where no pad is: half way between two of them.
    seam = np.array([*meridian(float(seats.pad_azimuth[k]) + np.pi / 3), ALONG])
    section = _hollow_section(cup, pocket, float(seats.bottom[k]))
    room = moved(revolved(section), seam, np.zeros(3))
    posts = [
        cylinder(-(radius + offset) * n, -n, float(seats.pad[k]), cup - radius + POST_MM)
        for n in seats.local_normals[k]
    ]
    return cut(room, posts)


def insertion_path(seats: Seats, k: int) -> TopoDS_Shape:
    """What a ball needs to be inserted, in its own frame."""
    out = seats.insertion[k] @ seats.axes[k].T
    length = float(np.linalg.norm(out))
    radius = seats.radius[k] + (1 - NARROWER) * (seats.cup[k] - seats.radius[k])
    return cylinder(np.zeros(3), out / length, float(radius), length)


def column_behind_boss(seats: Seats, k: int, length: float) -> TopoDS_Shape:
    """Cylinder behind a boss, in its own frame; no face of it lies on one of the boss."""
    start = (seats.back[k] - INTO_BOSS_MM) * ALONG
    return cylinder(start, ALONG, float(seats.boss[k]) - INTO_BOSS_MM, length)


def moved_to_seat(shape: TopoDS_Shape, seats: Seats, k: int) -> TopoDS_Shape:
    """A shape of the seat's own frame moved to its place."""
    return moved(shape, seats.axes[k], seats.centre[k])


def _hollow_section(cup: float, pocket: float, bottom: float) -> TopoDS_Face:
    """Half section in y = 0: cup and pocket below it.

    The cup's front half is a hemisphere short of its pole, since a pole makes bad facets.
    """
    front = -cup * float(np.cos(POLE_ANGLE))
    rim = (cup * float(np.sin(POLE_ANGLE)), front)
    edge = (pocket, float(np.sqrt(cup**2 - pocket**2)))
    axis: list[Point] = [(0.0, bottom), (0.0, front)]
    arc = arc_about_axis(0.0, cup, rim, edge)
    return section_face([*lines([axis[1], rim]), arc, *lines([edge, (pocket, bottom), *axis])])


def section_face(edges: Sequence[TopoDS_Edge]) -> TopoDS_Face:
    """Face in y = 0 inside edges that follow each other and close."""
    wire = BRepBuilderAPI_MakeWire()
    for edge in edges:
        wire.Add(edge)
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face()


def lines(points: Sequence[Point]) -> list[TopoDS_Edge]:
    """Straight edges between points that follow each other."""
    return [
        BRepBuilderAPI_MakeEdge(gp_Pnt(a[0], 0, a[1]), gp_Pnt(b[0], 0, b[1])).Edge()
        for a, b in pairwise(points)
    ]


def arc_about_axis(middle: float, radius: float, start: Point, end: Point) -> TopoDS_Edge:
    """Arc about a point (0, middle) of the axis between two points, z rising."""
    circle = gp_Circ(gp_Ax2(gp_Pnt(0, 0, middle), gp_Dir(0, -1, 0), gp_Dir(1, 0, 0)), radius)
    ends = (gp_Pnt(start[0], 0, start[1]), gp_Pnt(end[0], 0, end[1]))
    return BRepBuilderAPI_MakeEdge(circle, *ends).Edge()
