"""One camera's half as a closed solid, built face by face without boolean operations."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.TopoDS import TopoDS_Face, TopoDS_Shape, TopoDS_Solid

from tbcad.design.body import Body, Holes
from tbcad.model.brep import Maker, Ring, Side
from tbcad.model.chains import boundary_chain, chain_ends
from tbcad.optics.cells import Arcs, Cells
from tbcad.optics.conics import EllipseArc

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Solid:
    """A solid and the names of its faces.

    Attributes:
        name: of the part.
        shape: the closed solid.
        faces: name and face, mirrors first in the order of their ids.
    """

    name: str
    shape: TopoDS_Solid
    faces: tuple[tuple[str, TopoDS_Face], ...]


class InvalidSolidError(RuntimeError):
    """The kernel's check refuses a solid: a fault of tbcad, not of the input."""


def shell(name: str, ids: list[str], cells: Cells, body: Body, mirrored: bool) -> Solid:
    """Solid of one half.

    Args:
        name: of the part.
        ids: names of the mirrors, in the order of the cells.
        cells: camera a's cells of the modelled surfaces.
        body: what closes them.
        mirrored: build the mirror image, camera b's half.

    Raises:
        InvalidSolidError: when the kernel finds the solid invalid.
    """
    maker = Maker(mirrored)
    front = _Front(maker, cells)
    faces = [*zip(ids, front.faces(), strict=True), *_body_faces(maker, front, body)]
    solid = maker.solid([face for _, face in faces])
    check(name, solid)
    return Solid(name, solid, tuple(faces))


def check(name: str, shape: TopoDS_Shape) -> None:
    """Let the kernel check a shape.

    Raises:
        InvalidSolidError: when it is not valid.
    """
    if not BRepCheck_Analyzer(shape).IsValid():
        raise InvalidSolidError(f"{name}: the kernel's check finds the solid invalid")


class _Front:
    """Vertices, edges and faces of the cells."""

    def __init__(self, maker: Maker, cells: Cells) -> None:
        self.maker, self.cells, arcs = maker, cells, cells.arcs
        used = np.unique(np.concatenate([arcs.start, arcs.end]))
        self.vertices = {int(c): maker.vertex(cells.corners[c]) for c in used}
        self.edges = [self._edge(arcs, *arc) for arc in zip(*_circles(arcs), strict=True)]

    def _edge(self, arcs, index, centre, x, y, radius, angle):  # type: ignore[no-untyped-def]
        start, end = self.vertices[arcs.start[index]], self.vertices[arcs.end[index]]
        if angle == 0:
            points = arcs.points[index]
            return self.maker.line(points[0], points[2], start, end)
        return self.maker.circle(centre, x, y, radius, angle, start, end)

    def faces(self) -> list[TopoDS_Face]:
        """One face for each cell, on its sphere (or plane)."""
        offsets, sides = self.cells.rings
        surfaces, maker = self.cells.surfaces, self.maker
        radius, centre = surfaces.radius, surfaces.centre
        faces = []
        for i in range(self.cells.mirrors):
            ring = self.ring(sides[offsets[i] : offsets[i + 1]])
            if surfaces.curvature[i] == 0:
                plane = maker.plane(surfaces.apex[i], surfaces.normal[i])
                faces.append(maker.face(plane, [ring], natural=True))
                continue
            sphere = maker.sphere(centre[i], radius[i], surfaces.normal[i])
            face = maker.face(sphere, [ring], natural=True)
            maker.add_pcurves(face, ring)
            faces.append(face)
        return faces

    def ring(self, sides: Ints) -> list[Side]:
        """Edges round a cell, counter-clockwise seen from the light."""
        return [(self.edges[s // 2], bool(s % 2)) for s in sides[::-1]]

    def chain(self, plane: int) -> list[Side]:
        """Edges along the seam or the foot, from low to high y."""
        return [(self.edges[arc], forward) for arc, forward in boundary_chain(self.cells, plane)]

    def ends(self) -> tuple[int, int]:
        """Corners where seam and foot meet, lower y first."""
        return chain_ends(self.cells, boundary_chain(self.cells, self.cells.boundary.seam))


def _circles(arcs: Arcs) -> tuple[Ints, Floats, Floats, Floats, Floats, Floats]:
    """Index, centre, directions to start and along, radius and angle of every arc.

    The angle is zero for straight ones.
    """
    start, control, end = (arcs.points[:, k] for k in range(3))
    along = control - start
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    half = np.linalg.norm(end - start, axis=1) / 2
    straight = arcs.weight == 1
    sine = np.sqrt(1 - arcs.weight**2)
    radius = np.divide(half, sine, out=np.ones_like(half), where=~straight)
    chord = (end - start) / (2 * half[:, None])
    # Away from the centre at the start: across the tangent in the arc's plane.
    outward = along - np.einsum("ex,ex->e", along, chord)[:, None] * chord
    size = np.linalg.norm(outward, axis=1, keepdims=True)
    outward = np.divide(outward, size, out=np.zeros_like(outward), where=size > 0)
    x = arcs.weight[:, None] * outward - sine[:, None] * chord
    centre = start - radius[:, None] * x
    angle = np.where(straight, 0.0, 2 * np.arcsin(np.minimum(sine, 1)))
    return np.arange(len(arcs)), centre, x, along, radius, angle


def _body_faces(maker: Maker, front: _Front, body: Body) -> list[tuple[str, TopoDS_Face]]:
    """Back, flanges and walls, with their holes; rings are listed in `docs` order."""
    e = _Edges(maker, front, body)
    seam_holes = _Bores(maker, body.seam_holes, Y, Z)
    foot_holes = _Bores(maker, body.foot_holes, X, Y)
    seam, foot = body.seam_thickness, body.foot_thickness
    base = body.foot * Z

    back = maker.face(maker.spheroid(body.back), [[e.foot_back, turned(e.seam_back)]], natural=False)
    maker.add_pcurves(back, [e.foot_back, e.seam_back])
    seam_back = [e.seam_step_low, e.seam_back, e.seam_step_high, turned(e.seam_rim_back)]
    foot_top = [
        e.foot_rim_top,
        turned(e.foot_step_high),
        e.seam_end_high,
        turned(e.seam_step_high),
        turned(e.foot_back),
        turned(e.seam_step_low),
        turned(e.seam_end_low),
        e.foot_step_low,
    ]
    seam_wall = [
        e.wall_low,
        *front.chain(front.cells.boundary.seam),
        e.wall_high,
        e.foot_end_high,
        turned(e.foot_step_high),
        turned(e.seam_rim),
        e.foot_step_low,
        turned(e.foot_end_low),
    ]
    foot_wall = [
        e.foot_rim,
        turned(e.wall_high),
        *around(front.chain(front.cells.boundary.foot)),
        turned(e.wall_low),
    ]
    return [
        ("back", back),
        ("seam", maker.face(maker.plane(0 * X, -X), [around(seam_wall), *seam_holes.near], True)),
        ("foot", maker.face(maker.plane(base, -Z), [around(foot_wall), *foot_holes.near], True)),
        ("seam_flange", maker.face(maker.plane(seam, X), [seam_back, *seam_holes.far], True)),
        ("foot_flange", maker.face(maker.plane(base + foot, Z), [foot_top, *foot_holes.far], True)),
        ("seam_rim", e.seam_rim_face()),
        ("foot_rim", e.foot_rim_face()),
        *((f"seam_hole_{k + 1:02d}", f) for k, f in enumerate(seam_holes.faces())),
        *((f"foot_hole_{k + 1:02d}", f) for k, f in enumerate(foot_holes.faces())),
    ]


def turned(side: Side) -> Side:
    """The same edge followed the other way."""
    return side[0], not side[1]


def around(ring: Ring) -> list[Side]:
    """The same ring the other way round."""
    return [turned(side) for side in reversed(ring)]


class _Edges:
    """All edges of the body; each runs from low to high y, or away from the joining faces."""

    def __init__(self, maker: Maker, front: _Front, body: Body) -> None:
        self.maker, self.body = maker, body
        seam, foot = body.seam_thickness, body.foot_thickness
        low, high = front.ends()
        corner = front.cells.corners
        points = {
            "front": (corner[low], corner[high]),
            "back": _ends(body.seam_back),
            "seam": _ends(body.seam_rim),
            "seam_back": _ends(body.seam_rim.moved(seam)),
            "foot": _ends(body.foot_rim),
            "foot_top": _ends(body.foot_rim.moved(foot)),
        }
        vertex = {k: (maker.vertex(a), maker.vertex(b)) for k, (a, b) in points.items()}
        vertex["front"] = (front.vertices[low], front.vertices[high])

        def line(a: str, b: str, k: int) -> Side:
            return maker.line(points[a][k], points[b][k], vertex[a][k], vertex[b][k]), True

        self.seam_back = maker.ellipse_edge(body.seam_back, *vertex["back"])
        self.foot_back = maker.ellipse_edge(body.foot_back, *vertex["back"])
        self.seam_rim = maker.ellipse_edge(body.seam_rim, *vertex["seam"])
        self.seam_rim_back = maker.ellipse_edge(body.seam_rim.moved(seam), *vertex["seam_back"])
        self.foot_rim = maker.ellipse_edge(body.foot_rim, *vertex["foot"])
        self.foot_rim_top = maker.ellipse_edge(body.foot_rim.moved(foot), *vertex["foot_top"])
        self.seam_end_low, self.seam_end_high = (line("seam", "seam_back", k) for k in (0, 1))
        self.foot_end_low, self.foot_end_high = (line("foot", "foot_top", k) for k in (0, 1))
        self.seam_step_low = line("seam_back", "back", 0)
        self.seam_step_high = turned(line("seam_back", "back", 1))
        self.foot_step_low, self.foot_step_high = (line("seam", "foot_top", k) for k in (0, 1))
        self.wall_low = line("foot", "front", 0)
        self.wall_high = turned(line("foot", "front", 1))

    def seam_rim_face(self) -> TopoDS_Face:
        """Outer face of the seam flange."""
        ring = [self.seam_end_low, self.seam_rim_back, turned(self.seam_end_high), turned(self.seam_rim)]
        ends = (self.seam_end_low, self.seam_end_high)
        return self._rim_face(self.body.seam_rim, self.body.seam_thickness, ring, ends,
                              (self.seam_rim, self.seam_rim_back), Z)

    def foot_rim_face(self) -> TopoDS_Face:
        """Outer face of the foot flange."""
        ring = [self.foot_rim, self.foot_end_high, turned(self.foot_rim_top), turned(self.foot_end_low)]
        ends = (self.foot_end_low, self.foot_end_high)
        return self._rim_face(self.body.foot_rim, self.body.foot_thickness, ring, ends,
                              (self.foot_rim, self.foot_rim_top), X)

    def _rim_face(self, arc: EllipseArc, along: Floats, ring: Ring, ends: Ring, rims: Ring,
                  outward: Floats) -> TopoDS_Face:
        """Face of an elliptic cylinder; its middle looks about the way of outward."""
        middle = (arc.first + arc.last) / 2
        tangent = np.cos(middle) * arc.ellipse.minor - np.sin(middle) * arc.ellipse.major
        natural = float(np.cross(tangent, along) @ outward) > 0
        face = self.maker.face(
            self.maker.extrusion(arc.ellipse, along), [ring], natural != self.maker.mirrored
        )
        height = float(np.linalg.norm(along))
        for (edge, _), v in zip(rims, (0.0, height), strict=True):
            self.maker.straight_pcurve(edge, face, (0.0, v), (1.0, 0.0))
        for (edge, _), u in zip(ends, (arc.first, arc.last), strict=True):
            self.maker.straight_pcurve(edge, face, (u, 0.0), (0.0, 1.0))
        return face


def _ends(arc: EllipseArc) -> tuple[Floats, Floats]:
    start, end = arc.at(np.array([0.0, 1.0]))
    return start, end


class _Bores:
    """Circles and cylinders of through holes."""

    def __init__(self, maker: Maker, holes: Holes, x: Floats, y: Floats) -> None:
        """Prepare all circles; x cross y is the holes' direction."""
        self.maker, self.holes, self.x, self.y = maker, holes, x, y
        far = holes.centre + holes.direction
        starts = [holes.centre + r * x for r in ()]
        del starts
        self.circles = [
            (self._circle(a, r), self._circle(b, r))
            for a, b, r in zip(holes.centre, far, holes.radius, strict=True)
        ]
        self.near: list[Ring] = [[(a[0], True)] for a, _ in self.circles]
        self.far: list[Ring] = [[(b[0], False)] for _, b in self.circles]

    def _circle(self, centre: Floats, radius: float):  # type: ignore[no-untyped-def]
        point = centre + radius * self.x
        vertex = self.maker.vertex(point)
        edge = self.maker.circle(centre, self.x, self.y, radius, 2 * np.pi, vertex, vertex)
        return edge, vertex, point

    def faces(self) -> list[TopoDS_Face]:
        """The cylinders."""
        return [self._face(*args) for args in zip(self.circles, self.holes.centre, self.holes.radius, strict=True)]

    def _face(self, circles, centre: Floats, radius: float) -> TopoDS_Face:  # type: ignore[no-untyped-def]
        (near, start, p), (far, end, q) = circles
        seam = self.maker.line(p, q, start, end)
        ring = [(seam, True), (far, True), (seam, False), (near, False)]
        surface = self.maker.cylinder(centre, self.x, self.y, radius)
        face = self.maker.face(surface, [ring], natural=False)
        height = float(np.linalg.norm(self.holes.direction))
        v = -height if self.maker.mirrored else height
        self.maker.straight_pcurve(near, face, (0.0, 0.0), (1.0, 0.0))
        self.maker.straight_pcurve(far, face, (0.0, v), (1.0, 0.0))
        self.maker.seam_pcurves(seam, face)
        return face
