"""Round holes: circles at both ends and the cylinders between them."""

from dataclasses import dataclass

import numpy as np
from OCP.Geom import Geom_CylindricalSurface
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Vertex

from tbcad.cad.brep import Maker, Ring
from tbcad.types import Floats


@dataclass(frozen=True)
class _Circle:
    """A whole circle as an edge, with the point and vertex where it starts and ends."""

    edge: TopoDS_Edge
    vertex: TopoDS_Vertex
    point: Floats


def hole_faces(
    maker: Maker, centre: Floats, direction: Floats, radius: Floats, x: Floats, y: Floats
) -> tuple[list[Ring], list[Ring], list[TopoDS_Face]]:
    """Holes whose direction is x cross y.

    Args:
        maker: of kernel shapes.
        centre: where they begin, mm, (k, 3).
        direction: into the material, length their depth, mm, (3,).
        radius: mm, (k,).
        x: unit vector across.
        y: unit vector across.

    Returns:
        Inner rings of the face where they begin, those where they end, and the cylinders.
    """
    sizes = list(zip(centre, radius, strict=True))
    near = [_circle(maker, start, x, y, radius) for start, radius in sizes]
    far = [_circle(maker, start + direction, x, y, radius) for start, radius in sizes]
    cylinders = [maker.cylinder(start, x, y, radius) for start, radius in sizes]
    height = float(np.linalg.norm(direction))
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
