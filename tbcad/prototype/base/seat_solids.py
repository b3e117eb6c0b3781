"""Bosses of the seats, what is cut out of them, and caps.

A cap is a part like a ball whose front is turned to a larger radius, for the same seat. Each is
built in the seat's own frame with the ball's centre at the origin and the seat's axis
along z, and then moved: a sphere whose axis is not the axis of the cut comes out invalid now and
then.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from manifold3d import Manifold, OpType
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Solid

from tbcad.cad.kernel.brep import Maker, Ring, hole_faces
from tbcad.cad.kernel.checks import closed_mesh, properties
from tbcad.cad.kernel.meshing import growth, primitive_mesh
from tbcad.cad.kernel.solids import cylinder, faces, moved, on_sphere, one_solid, revolved, wires
from tbcad.common.reuse import kept
from tbcad.core.geometry.primitives import Cylinder, Revolved
from tbcad.core.geometry.vectors import perpendicular_axes
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.caps import cap_pocket, cap_spigot, flat_depth
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import meridian
from tbcad.prototype.base.seats import Seats
from tbcad.prototype.printed import PlacedSolid
from tbcad.types import Floats

# The path is narrower than the cup by this share of the cup's clearance, so that the two meet at
# an angle.
NARROWER = 0.4
INTO_BOSS_MM = 0.3  # by which the space behind a boss begins inside of it, and is narrower
ARC_POINTS = 25  # of a cup's section in its mesh
POLE_ANGLE = 0.3  # about the axis, radians: the cup's hemisphere ends here, short of its pole
OWN_AXES = np.eye(3)
ALONG = OWN_AXES[2]

Point = tuple[float, float]
"""A point (x out, z along) of the half-plane y = 0."""
UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0])


def boss_solid(seats: Seats, k: int) -> TopoDS_Shape:
    """Solid boss in its own frame."""
    length = float(seats.back[k] - seats.front[k])
    return cylinder(seats.front[k] * ALONG, ALONG, float(seats.boss[k]), length)


def seat_hollow(seats: Seats, k: int) -> TopoDS_Solid:
    """Hollow for a ball and its magnet, without posts of pads, in the own frame of seat k."""
    bounding = with_posts(faces(seat_room(seats, k)), seats, k, seats.pad_offset)
    return Maker(mirrored=False).solid(bounding)


def seat_room(seats: Seats, k: int) -> TopoDS_Shape:
    """Room of a ball and its magnet where no pads are, in the seat's own frame."""
    # Seams where no pad is: half way between two of them.
    seam = np.array([*meridian(float(seats.pad_azimuth[k]) + np.pi / 3), ALONG])
    sizes = float(seats.cup[k]), float(seats.pocket[k]), float(seats.bottom[k])
    return moved(revolved(_hollow_section(*sizes)), seam, np.zeros(3))


def with_posts(
    room: Sequence[TopoDS_Face], seats: Seats, k: int, offset: float, axes: Floats = OWN_AXES
) -> list[TopoDS_Face]:
    """Faces that bound the room of seat k with those of the posts of its pads.

    The room is on the inner side of its faces, the ball's centre at the origin; the only ones on a
    sphere are the cup's. Pads are moved off the ball by an offset (mm). The rows of axes (3, 3) are
    what the seat's own x, y and z have become.
    """
    maker = Maker(mirrored=False)
    size = (float(seats.cup[k]), float(seats.radius[k]) + offset, float(seats.pad[k]))
    posts = [_post_faces(maker, n, *size) for n in seats.local_normals[k] @ axes]
    rims = [rim for rim, _ in posts]
    cups = [_with_holes(maker, one, rims) for one in room if on_sphere(one)]
    others = [one for one in room if not on_sphere(one)]
    return [*cups, *others, *(one for _, post in posts for one in post)]


def seat_hollow_mesh(seats: Seats, k: int) -> Manifold:
    """The same by a boolean of meshes."""
    radius, cup, pocket = float(seats.radius[k]), float(seats.cup[k]), float(seats.pocket[k])
    angle = np.linspace(np.arcsin(pocket / cup), np.pi - POLE_ANGLE, ARC_POINTS)
    arc = growth(angle[1] - angle[0]) * cup * np.column_stack([np.cos(angle), np.sin(angle)])
    bottom = [[seats.bottom[k], 0.0], [seats.bottom[k], pocket]]
    room = primitive_mesh(Revolved(np.vstack([bottom, arc, [arc[-1, 0], 0.0]])))
    posts = [
        primitive_mesh(Cylinder(-(radius + seats.pad_offset) * n, -n, float(seats.pad[k]), cup))
        for n in seats.local_normals[k]
    ]
    return Manifold.batch_boolean([room, *posts], OpType.Subtract)


def _post_faces(
    maker: Maker, normal: Floats, cup: float, end: float, radius: float
) -> tuple[Ring, list[TopoDS_Face]]:
    """A pad's post: its rim on the sphere of a cup (mm); its wall, and the pad at its end.

    The normal (3,) points from the pad to the ball's centre, which is the origin. Seats leave a web
    between pads and pocket, so that the rim is a whole circle.
    """
    start = float(np.sqrt(cup**2 - radius**2))
    centre, depth = -start * normal[None], (start - end) * normal
    axes = perpendicular_axes(normal)
    (rim,), (edge,), walls = hole_faces(maker, centre, depth, np.array([radius]), *axes)
    return rim, [*walls, maker.face(maker.plane(-end * normal, -normal), [edge], natural=True)]


def _with_holes(maker: Maker, face: TopoDS_Face, rims: Sequence[Ring]) -> TopoDS_Face:
    """A face with holes inside rings of edges that lie on its surface."""
    holed = TopoDS.Face_s(face.EmptyCopied())
    for wire in wires(face):
        maker.builder.Add(holed, wire)
    for rim in rims:
        maker.builder.Add(holed, maker.wire(rim))
        maker.add_pcurves(holed, rim)
    return holed


def insertion_path(seats: Seats, k: int) -> TopoDS_Shape:
    """Room to insert a ball, in its own frame."""
    out = seats.insertion[k] @ seats.axes[k].T
    length = float(np.linalg.norm(out))
    radius = seats.radius[k] + (1 - NARROWER) * (seats.cup[k] - seats.radius[k])
    return cylinder(np.zeros(3), out / length, float(radius), length)


def column_behind_boss(seats: Seats, k: int, length: float) -> TopoDS_Shape:
    """Cylinder behind a boss, in its own frame; no face of it lies on one of the boss."""
    start = (seats.back[k] - INTO_BOSS_MM) * ALONG
    return cylinder(start, ALONG, float(seats.boss[k]) - INTO_BOSS_MM, length)


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


def cap_parts(base: BaseLayout, prototype: PrototypeLayout, mesh_mm: float) -> list[PlacedSolid]:
    """A cap for each ball that is not bought, in its seat, its front up when it is printed."""
    balls = prototype.balls
    sizes = zip(balls.radius.tolist(), balls.body_depth.tolist(), strict=True)
    return [_cap(base, k, *size, mesh_mm) for k, size in enumerate(sizes) if balls.cap[k]]


@kept("caps")
def _cap(base: BaseLayout, k: int, front: float, depth: float, mesh_mm: float) -> PlacedSolid:
    name, axes, centre = f"cap_{k + 1}", base.seats.axes[k], base.seats.centre[k]
    section = _section(base, front, depth, k)
    shape = one_solid(name, moved(revolved(section), axes, centre))
    # The front is up and the flat lies on the bed.
    on_bed = axes.T @ UPSIDE_DOWN
    _, end = cap_spigot(base, k)
    mesh, origin = closed_mesh(name, shape, mesh_mm), np.array([0, 0, end]) - centre @ on_bed
    return PlacedSolid(name, shape, mesh, properties(shape), on_bed, origin)


def _section(base: BaseLayout, front: float, depth: float, k: int) -> TopoDS_Face:
    """Half section in y = 0: front, body, flat, spigot, pocket."""
    body, flat = float(base.seats.radius[k]), flat_depth(base, k)
    pocket, pocket_depth = cap_pocket(base, k, depth)
    spigot, end = cap_spigot(base, k)
    half_width = body / np.sqrt(2)
    apex, edge = (0.0, -depth), (half_width, -half_width)
    rim = (float(np.sqrt(body**2 - flat**2)), flat)
    if front > body:
        arcs = [
            arc_about_axis(front - depth, front, apex, edge),
            arc_about_axis(0.0, body, edge, rim),
        ]
    else:
        arcs = [arc_about_axis(0.0, body, apex, rim)]
    back: list[Point] = [(spigot, flat), (spigot, end)]
    if pocket:
        back += [(pocket, end), (pocket, end - pocket_depth)]
    back.append((0.0, end - (pocket_depth if pocket else 0.0)))
    return section_face([*arcs, *lines([rim, *back, apex])])
