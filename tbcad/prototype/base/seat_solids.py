"""Bosses of the seats, and what is cut out of them: cup, pocket and way, but not the pads.

Both are built in the seat's own frame with the ball's centre at the origin and the seat's axis
along z, and then moved: a sphere whose axis is not the axis of the cut comes out invalid now and
then.
"""

import numpy as np
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape

from tbcad.cad.solids import cut, cylinder, moved, revolved
from tbcad.prototype.base.seats import Seats

# Of the cup's radius: the way is a little narrower, so that the two meet at an angle.
NARROWER = 0.4
# A post of each pad goes this far into the boss.
POST_MM = 1.5
# What frees a boss's end begins this far inside of the boss.
INTO_MM = 0.3
ALONG = np.array([0.0, 0.0, 1.0])


def boss_solid(seats: Seats, k: int) -> TopoDS_Shape:
    """Solid boss in its own frame."""
    length = float(seats.back[k] - seats.front[k])
    return cylinder(seats.front[k] * ALONG, ALONG, float(seats.boss[k]), length)


def seat_hollow(seats: Seats, k: int, offset: float = 0.0) -> TopoDS_Shape:
    """What a ball and its magnet need, without the posts of the pads, in the seat's own frame.

    Args:
        seats: of all balls.
        k: which.
        offset: how far the pads are moved off the ball, mm.
    """
    radius, cup, pocket = float(seats.radius[k]), float(seats.cup[k]), float(seats.pocket[k])
    # Seams where no pad is: half way between two of them.
    turn = float(seats.turn[k]) + np.pi / 3
    seam = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], ALONG])
    room = moved(revolved(_half(cup, pocket, float(seats.bottom[k]))), seam, np.zeros(3))
    posts = [
        cylinder(-(radius + offset) * n, -n, float(seats.pad[k]), cup - radius + POST_MM)
        for n in seats.local_normals[k]
    ]
    return cut(room, posts)


def insertion_path(seats: Seats, k: int) -> TopoDS_Shape:
    """What a ball needs to be put in, in its own frame."""
    out = seats.way[k] @ seats.axes[k].T
    length = float(np.linalg.norm(out))
    radius = seats.radius[k] + (1 - NARROWER) * (seats.cup[k] - seats.radius[k])
    return cylinder(np.zeros(3), out / length, float(radius), length)


def column_behind_boss(seats: Seats, k: int, length: float) -> TopoDS_Shape:
    """Cylinder behind a boss, in its own frame; no face of it lies on one of the boss."""
    start = (seats.back[k] - INTO_MM) * ALONG
    return cylinder(start, ALONG, float(seats.boss[k]) - INTO_MM, length)


def moved_to_seat(shape: TopoDS_Shape, seats: Seats, k: int) -> TopoDS_Shape:
    """A shape of the seat's own frame moved to its place."""
    return moved(shape, seats.axes[k], seats.centre[k])


def _half(cup: float, pocket: float, bottom: float) -> TopoDS_Face:
    """Half section (x out, z along): cup and pocket below it, in y = 0.

    The cup's front half is a hemisphere short of its pole, since a pole makes bad facets.
    """
    low = float(np.sqrt(cup**2 - pocket**2))
    high = -cup * float(np.cos(0.3))
    points = [
        gp_Pnt(0, 0, high),
        gp_Pnt(cup * float(np.sin(0.3)), 0, high),
        gp_Pnt(pocket, 0, low),
        gp_Pnt(pocket, 0, bottom),
        gp_Pnt(0, 0, bottom),
    ]
    circle = gp_Circ(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, -1, 0), gp_Dir(1, 0, 0)), cup)
    wire = BRepBuilderAPI_MakeWire()
    wire.Add(BRepBuilderAPI_MakeEdge(points[0], points[1]).Edge())
    wire.Add(BRepBuilderAPI_MakeEdge(circle, points[1], points[2]).Edge())
    for a, b in zip(points[2:], [*points[3:], points[0]], strict=True):
        wire.Add(BRepBuilderAPI_MakeEdge(a, b).Edge())
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face()
