"""B-rep pieces on shared vertices and edges, straight from the kernel's builder.

Coordinates come in for camera a; a `Maker` for camera b mirrors every point on its way in and
turns every wire round, so that both halves come from one description.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.Geom import (
    Geom_Circle,
    Geom_Curve,
    Geom_CylindricalSurface,
    Geom_Ellipse,
    Geom_Line,
    Geom_Plane,
    Geom_SphericalSurface,
    Geom_Surface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_TrimmedCurve,
)
from OCP.Geom2d import Geom2d_Line
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d
from OCP.ShapeFix import ShapeFix_Edge
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopoDS import (
    TopoDS,
    TopoDS_Edge,
    TopoDS_Face,
    TopoDS_Shell,
    TopoDS_Solid,
    TopoDS_Vertex,
    TopoDS_Wire,
)

from tbcad.core.geometry.conics import Ellipse, EllipseArc, Spheroid
from tbcad.types import Floats

Side = tuple[TopoDS_Edge, bool]
Ring = Sequence[Side]

TOLERANCE = 1e-6


@dataclass(frozen=True)
class Solid:
    """A solid and the names of its faces."""

    name: str  # of the part
    shape: TopoDS_Solid  # the closed solid
    faces: tuple[tuple[str, TopoDS_Face], ...]  # name and face, mirrors first by id


class InvalidSolidError(RuntimeError):
    """The kernel's check refuses a solid: a fault of tbcad, not of the input."""


@dataclass
class Maker:
    """Makes kernel shapes from arrays, mirrored in x = 0 for camera b."""

    mirrored: bool
    builder: BRep_Builder = field(default_factory=BRep_Builder)
    pcurves: ShapeFix_Edge = field(default_factory=ShapeFix_Edge)

    @property
    def _sign(self) -> float:
        return -1.0 if self.mirrored else 1.0

    def point(self, p: Floats) -> gp_Pnt:
        """Kernel point."""
        return gp_Pnt(self._sign * p[0], p[1], p[2])

    def direction(self, v: Floats) -> gp_Dir:
        """Kernel direction."""
        return gp_Dir(self._sign * v[0], v[1], v[2])

    def frame(self, origin: Floats, x: Floats, y: Floats) -> gp_Ax2:
        """Right-handed frame whose first two axes are x and y, mirrored like all else."""
        dx, dy = self.direction(x), self.direction(y)
        return gp_Ax2(self.point(origin), dx.Crossed(dy), dx)

    def vertex(self, p: Floats) -> TopoDS_Vertex:
        """Vertex at a point (3,)."""
        vertex = TopoDS_Vertex()
        self.builder.MakeVertex(vertex, self.point(p), TOLERANCE)
        return vertex

    def edge(
        self, curve: Geom_Curve, first: float, last: float, start: TopoDS_Vertex, end: TopoDS_Vertex
    ) -> TopoDS_Edge:
        """Edge along a curve between two parameters."""
        edge = TopoDS_Edge()
        self.builder.MakeEdge(edge, curve, TOLERANCE)
        self.builder.Add(edge, start.Oriented(TopAbs_FORWARD))
        self.builder.Add(edge, end.Oriented(TopAbs_REVERSED))
        self.builder.Range(edge, first, last)
        return edge

    def line(self, a: Floats, b: Floats, start: TopoDS_Vertex, end: TopoDS_Vertex) -> TopoDS_Edge:
        """Straight edge from a to b, its parameter the length."""
        return self.edge(
            Geom_Line(self.point(a), self.direction(b - a)),
            0.0,
            float(np.linalg.norm(b - a)),
            start,
            end,
        )

    def circle(
        self,
        centre: Floats,
        x: Floats,
        y: Floats,
        radius: float,
        angle: float,
        start: TopoDS_Vertex,
        end: TopoDS_Vertex,
    ) -> TopoDS_Edge:
        """Circular edge from centre + radius x, by an angle toward y."""
        curve = Geom_Circle(self.frame(centre, x, y), radius)
        return self.edge(curve, 0.0, angle, start, end)

    def ellipse(self, ellipse: Ellipse) -> Geom_Ellipse:
        """Ellipse whose parameter agrees with the array form."""
        return Geom_Ellipse(
            self.frame(ellipse.centre, ellipse.major, ellipse.minor),
            float(np.linalg.norm(ellipse.major)),
            float(np.linalg.norm(ellipse.minor)),
        )

    def ellipse_edge(
        self, arc: EllipseArc, start: TopoDS_Vertex, end: TopoDS_Vertex
    ) -> tuple[TopoDS_Edge, bool]:
        """Edge along an elliptic arc, and whether it runs from start to end."""
        forward = arc.last > arc.first
        first, last = sorted((arc.first, arc.last))
        ends = (start, end) if forward else (end, start)
        return self.edge(self.ellipse(arc.ellipse), first, last, *ends), forward

    def plane(self, origin: Floats, normal: Floats) -> Geom_Plane:
        """Plane through a point, its natural normal as given."""
        return Geom_Plane(self.point(origin), self.direction(normal))

    def sphere(self, centre: Floats, radius: float, toward: Floats) -> Geom_SphericalSurface:
        """Sphere whose seam and poles are turned away from a direction."""
        helper = np.eye(3)[np.argmin(np.abs(toward))]
        axis = np.cross(toward, helper)
        frame = gp_Ax2(self.point(centre), self.direction(axis), self.direction(-toward))
        return Geom_SphericalSurface(gp_Ax3(frame), radius)

    def spheroid(self, spheroid: Spheroid) -> Geom_SurfaceOfRevolution:
        """Spheroid by turning half an ellipse about w, its seam away from the mirrors."""
        w, up, _ = spheroid.ellipsoid.frame()
        major, minor = spheroid.semi_axes
        ellipse = Geom_Ellipse(self.frame(spheroid.centre, w, -up), major, minor)
        half = Geom_TrimmedCurve(ellipse, 0.0, np.pi)
        axis = gp_Ax1(self.point(spheroid.centre), self.direction(w))
        return Geom_SurfaceOfRevolution(half, axis)

    def extrusion(self, ellipse: Ellipse, direction: Floats) -> Geom_SurfaceOfLinearExtrusion:
        """Elliptic cylinder along a direction."""
        return Geom_SurfaceOfLinearExtrusion(self.ellipse(ellipse), self.direction(direction))

    def cylinder(
        self, centre: Floats, x: Floats, y: Floats, radius: float
    ) -> Geom_CylindricalSurface:
        """Cylinder about x cross y, its seam toward x."""
        return Geom_CylindricalSurface(gp_Ax3(self.frame(centre, x, y)), radius)

    def wire(self, ring: Ring) -> TopoDS_Wire:
        """Closed wire of edges, each followed forward or back."""
        wire = TopoDS_Wire()
        self.builder.MakeWire(wire)
        for edge, forward in ring:
            along = forward != self.mirrored
            self.builder.Add(wire, edge.Oriented(TopAbs_FORWARD if along else TopAbs_REVERSED))
        wire.Closed(True)
        return wire

    def face(self, surface: Geom_Surface, rings: Sequence[Ring], natural: bool) -> TopoDS_Face:
        """Face on a surface on which all edges lie.

        Rings run counter-clockwise seen from outside the solid (camera a's coordinates), the outer
        ring first; natural: whether the surface's natural normal points out of the solid.
        """
        face = TopoDS_Face()
        self.builder.MakeFace(face, surface, TOLERANCE)
        for ring in rings:
            wire = self.wire(ring)
            self.builder.Add(face, wire if natural else wire.Reversed())
        return face if natural else TopoDS.Face_s(face.Reversed())

    def add_pcurves(self, face: TopoDS_Face, ring: Ring) -> None:
        """Curves in the surface's parameters for all edges of a ring, found by projection."""
        for edge, _ in ring:
            self.pcurves.FixAddPCurve(edge, face, False, TOLERANCE)

    def straight_pcurve(
        self,
        edge: TopoDS_Edge,
        face: TopoDS_Face,
        start: tuple[float, float],
        along: tuple[float, float],
    ) -> None:
        """A straight curve in the surface's parameters, with the edge's own parameter."""
        line = Geom2d_Line(gp_Pnt2d(*start), gp_Dir2d(*along))
        self.builder.UpdateEdge(edge, line, face, TOLERANCE)

    def seam_pcurves(self, edge: TopoDS_Edge, face: TopoDS_Face) -> None:
        """The two curves of a cylinder's seam, which climbs at u = 2 pi and comes back at u = 0.

        A mirrored cylinder's axis points the other way, and so all that is turned about.
        """
        along = gp_Dir2d(0.0, self._sign)
        near = Geom2d_Line(gp_Pnt2d(0.0, 0.0), along)
        far = Geom2d_Line(gp_Pnt2d(2 * np.pi, 0.0), along)
        pair = (near, far) if self.mirrored else (far, near)
        self.builder.UpdateEdge(edge, *pair, face, TOLERANCE)

    def solid(self, faces: Sequence[TopoDS_Face]) -> TopoDS_Solid:
        """Closed solid bounded by faces that share their edges."""
        shell, solid = TopoDS_Shell(), TopoDS_Solid()
        self.builder.MakeShell(shell)
        for face in faces:
            self.builder.Add(shell, face)
        shell.Closed(True)
        self.builder.MakeSolid(solid)
        self.builder.Add(solid, shell)
        return solid


def hole_faces(
    maker: Maker, centre: Floats, direction: Floats, radius: Floats, x: Floats, y: Floats
) -> tuple[list[Ring], list[Ring], list[TopoDS_Face]]:
    """Holes from centres (k, 3) on, with radii (k,), mm; their direction x cross y has their depth.

    x and y are unit vectors across. Inner rings of the face where they begin, those where they end,
    and the cylinders.
    """
    near: list[Ring] = []
    far: list[Ring] = []
    walls = []
    # A mirrored cylinder's axis points the other way.
    v = float(np.linalg.norm(direction)) * (-1 if maker.mirrored else 1)
    for start, size in zip(centre, radius, strict=True):
        middles = start, start + direction
        vertices = [maker.vertex(middle + size * x) for middle in middles]
        rims = [
            maker.circle(middle, x, y, size, 2 * np.pi, vertex, vertex)
            for middle, vertex in zip(middles, vertices, strict=True)
        ]
        seam = maker.line(middles[0] + size * x, middles[1] + size * x, *vertices)
        ring = [(seam, True), (rims[1], True), (seam, False), (rims[0], False)]
        face = maker.face(maker.cylinder(start, x, y, size), [ring], natural=False)
        maker.straight_pcurve(rims[0], face, (0.0, 0.0), (1.0, 0.0))
        maker.straight_pcurve(rims[1], face, (0.0, v), (1.0, 0.0))
        maker.seam_pcurves(seam, face)
        near.append([(rims[0], True)])
        far.append([(rims[1], False)])
        walls.append(face)
    return near, far, walls
