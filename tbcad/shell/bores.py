"""Round through holes: circles on both faces of a flange and the cylinders between."""

from dataclasses import dataclass

import numpy as np
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Vertex

from tbcad.cad.brep import Maker, Ring
from tbcad.shell.envelope import Holes
from tbcad.types import Floats


@dataclass(frozen=True)
class Circle:
    """A whole circle as an edge, with the point and vertex where it starts and ends."""

    edge: TopoDS_Edge
    vertex: TopoDS_Vertex
    point: Floats


@dataclass(frozen=True)
class Bores:
    """Holes of one flange.

    Attributes:
        near: rings on the joining face, as inner rings of it.
        far: rings on the opposite face.
        faces: the cylinders.
    """

    near: list[Ring]
    far: list[Ring]
    faces: list[TopoDS_Face]


def bores(maker: Maker, holes: Holes, x: Floats, y: Floats) -> Bores:
    """Circles and cylinders of holes whose direction is x cross y."""
    every = [
        _bore(maker, centre, holes.direction, x, y, radius)
        for centre, radius in zip(holes.centre, holes.radius, strict=True)
    ]
    return Bores(
        [[(near.edge, True)] for near, _, _ in every],
        [[(far.edge, False)] for _, far, _ in every],
        [face for _, _, face in every],
    )


def _circle(maker: Maker, centre: Floats, x: Floats, y: Floats, radius: float) -> Circle:
    point = centre + radius * x
    vertex = maker.vertex(point)
    edge = maker.circle(centre, x, y, radius, 2 * np.pi, vertex, vertex)
    return Circle(edge, vertex, point)


def _bore(
    maker: Maker, centre: Floats, direction: Floats, x: Floats, y: Floats, radius: float
) -> tuple[Circle, Circle, TopoDS_Face]:
    near = _circle(maker, centre, x, y, radius)
    far = _circle(maker, centre + direction, x, y, radius)
    seam = maker.line(near.point, far.point, near.vertex, far.vertex)
    ring = [(seam, True), (far.edge, True), (seam, False), (near.edge, False)]
    face = maker.face(maker.cylinder(centre, x, y, radius), [ring], natural=False)
    height = float(np.linalg.norm(direction))
    # A mirrored cylinder's axis points the other way.
    maker.straight_pcurve(near.edge, face, (0.0, 0.0), (1.0, 0.0))
    maker.straight_pcurve(far.edge, face, (0.0, -height if maker.mirrored else height), (1.0, 0.0))
    maker.seam_pcurves(seam, face)
    return near, far, face
