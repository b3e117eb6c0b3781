"""Round through holes: circles on both faces of a flange and the cylinders between them."""

from dataclasses import dataclass

import numpy as np
from OCP.Geom import Geom_CylindricalSurface
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Vertex

from tbcad.cad.brep import Maker, Ring
from tbcad.shell.envelope import Holes
from tbcad.types import Floats


@dataclass(frozen=True)
class _Circle:
    """A whole circle as an edge, with the point and vertex where it starts and ends."""

    edge: TopoDS_Edge
    vertex: TopoDS_Vertex
    point: Floats


def hole_faces(
    maker: Maker, holes: Holes, x: Floats, y: Floats
) -> tuple[list[Ring], list[Ring], list[TopoDS_Face]]:
    """Holes whose direction is x cross y.

    Returns:
        Inner rings of the joining face, those of the opposite face, and the cylinders.
    """
    sizes = list(zip(holes.centre, holes.radius, strict=True))
    near = [_circle(maker, centre, x, y, radius) for centre, radius in sizes]
    far = [_circle(maker, centre + holes.direction, x, y, radius) for centre, radius in sizes]
    cylinders = [maker.cylinder(centre, x, y, radius) for centre, radius in sizes]
    height = float(np.linalg.norm(holes.direction))
    return (
        [[(circle.edge, True)] for circle in near],
        [[(circle.edge, False)] for circle in far],
        [_wall(maker, *wall, height) for wall in zip(cylinders, near, far, strict=True)],
    )


def _circle(maker: Maker, centre: Floats, x: Floats, y: Floats, radius: float) -> _Circle:
    point = centre + radius * x
    vertex = maker.vertex(point)
    return _Circle(maker.circle(centre, x, y, radius, 2 * np.pi, vertex, vertex), vertex, point)


def _wall(
    maker: Maker, cylinder: Geom_CylindricalSurface, near: _Circle, far: _Circle, height: float
) -> TopoDS_Face:
    seam = maker.line(near.point, far.point, near.vertex, far.vertex)
    ring = [(seam, True), (far.edge, True), (seam, False), (near.edge, False)]
    face = maker.face(cylinder, [ring], natural=False)
    # A mirrored cylinder's axis points the other way.
    v = -height if maker.mirrored else height
    maker.straight_pcurve(near.edge, face, (0.0, 0.0), (1.0, 0.0))
    maker.straight_pcurve(far.edge, face, (0.0, v), (1.0, 0.0))
    maker.seam_pcurves(seam, face)
    return face
