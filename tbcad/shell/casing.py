"""The faces behind the mirrors: back, joining faces, flanges, rims and holes.

Rings are listed counter-clockwise as seen from outside the solid. Points of the casing's edges,
each with a low (y < 0) and a high end:

    front     where the mirrors end, on x = 0 and z = foot
    back      where back, seam flange and foot flange meet
    seam      outer corner of the seam flange on x = 0; seam_back: on its other face
    foot      outer corner of the foot flange on z = foot; foot_top: on its other face
"""

from dataclasses import dataclass

import numpy as np
from OCP.TopoDS import TopoDS_Face

from tbcad.cad.brep import Maker, Ring, Side
from tbcad.geometry.conics import EllipseArc
from tbcad.shell.bores import hole_faces
from tbcad.shell.boundary import boundary_chain, chain_ends
from tbcad.shell.envelope import Envelope
from tbcad.shell.front import FrontEdges
from tbcad.types import Floats

EndPair = tuple[Side, Side]
"""Two sides at the low and the high end."""

X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class CasingEdges:
    """Edges of the casing; arcs run from low to high y.

    Attributes:
        seam_back: between back and seam flange.
        foot_back: between back and foot flange.
        seam_rim: outer edge of the seam flange, on x = 0.
        seam_rim_back: on its other face.
        foot_rim: outer edge of the foot flange, on z = foot.
        foot_rim_top: on its other face.
        seam_end: from seam to seam_back, low and high.
        foot_end: from foot to foot_top.
        seam_step: from seam_back to back.
        foot_step: from seam to foot_top.
        wall: from foot to front.
    """

    seam_back: Side
    foot_back: Side
    seam_rim: Side
    seam_rim_back: Side
    foot_rim: Side
    foot_rim_top: Side
    seam_end: EndPair
    foot_end: EndPair
    seam_step: EndPair
    foot_step: EndPair
    wall: EndPair


def casing_faces(front: FrontEdges, envelope: Envelope) -> list[tuple[str, TopoDS_Face]]:
    """Names and faces of everything but the mirrors."""
    maker, edges = front.maker, _edges(front, envelope)
    seam_holes = hole_faces(maker, envelope.seam_holes, Y, Z)
    foot_holes = hole_faces(maker, envelope.foot_holes, X, Y)
    seam, foot, base = envelope.seam_thickness, envelope.foot_thickness, envelope.foot * Z

    def plane(point: Floats, normal: Floats, *rings: Ring) -> TopoDS_Face:
        return maker.face(maker.plane(point, normal), rings, natural=True)

    return [
        ("back", _back(maker, envelope, edges)),
        ("seam", plane(0 * X, -X, reversed_ring(_seam_outline(front, edges)), *seam_holes.near)),
        ("foot", plane(base, -Z, reversed_ring(_foot_outline(front, edges)), *foot_holes.near)),
        ("seam_flange", plane(seam, X, _seam_flange(edges), *seam_holes.far)),
        ("foot_flange", plane(base + foot, Z, _foot_flange(edges), *foot_holes.far)),
        (
            "seam_rim",
            _rim(
                maker,
                envelope.seam_rim,
                seam,
                (edges.seam_rim, edges.seam_rim_back),
                edges.seam_end,
                outward=Z,
            ),
        ),
        (
            "foot_rim",
            _rim(
                maker,
                envelope.foot_rim,
                foot,
                (edges.foot_rim, edges.foot_rim_top),
                edges.foot_end,
                outward=X,
            ),
        ),
        *((f"seam_hole_{k + 1:02d}", face) for k, face in enumerate(seam_holes.walls)),
        *((f"foot_hole_{k + 1:02d}", face) for k, face in enumerate(foot_holes.walls)),
    ]


def reversed_side(side: Side) -> Side:
    """The same edge followed the other way."""
    return side[0], not side[1]


def reversed_ring(ring: Ring) -> list[Side]:
    """The same ring the other way round."""
    return [reversed_side(side) for side in reversed(ring)]


def _edges(front: FrontEdges, envelope: Envelope) -> CasingEdges:
    maker, cells = front.maker, front.cells
    seam_rim_back = envelope.seam_rim.moved(envelope.seam_thickness)
    foot_rim_top = envelope.foot_rim.moved(envelope.foot_thickness)
    arcs = {
        "back": envelope.seam_back,
        "seam": envelope.seam_rim,
        "seam_back": seam_rim_back,
        "foot": envelope.foot_rim,
        "foot_top": foot_rim_top,
    }
    corners = chain_ends(cells, boundary_chain(cells, cells.boundary.seam))
    points = {name: _ends(arc) for name, arc in arcs.items()}
    vertices = {name: [maker.vertex(end) for end in ends] for name, ends in points.items()}
    points["front"] = [cells.corners[corner] for corner in corners]
    vertices["front"] = [front.vertices[corner] for corner in corners]

    def lines(a: str, b: str) -> EndPair:
        low, high = (
            maker.line(points[a][k], points[b][k], vertices[a][k], vertices[b][k]) for k in (0, 1)
        )
        return (low, True), (high, True)

    return CasingEdges(
        seam_back=maker.ellipse_edge(envelope.seam_back, *vertices["back"]),
        foot_back=maker.ellipse_edge(envelope.foot_back, *vertices["back"]),
        seam_rim=maker.ellipse_edge(envelope.seam_rim, *vertices["seam"]),
        seam_rim_back=maker.ellipse_edge(seam_rim_back, *vertices["seam_back"]),
        foot_rim=maker.ellipse_edge(envelope.foot_rim, *vertices["foot"]),
        foot_rim_top=maker.ellipse_edge(foot_rim_top, *vertices["foot_top"]),
        seam_end=lines("seam", "seam_back"),
        foot_end=lines("foot", "foot_top"),
        seam_step=lines("seam_back", "back"),
        foot_step=lines("seam", "foot_top"),
        wall=lines("foot", "front"),
    )


def _ends(arc: EllipseArc) -> list[Floats]:
    return list(arc.at(np.array([0.0, 1.0])))


def _back(maker: Maker, envelope: Envelope, edges: CasingEdges) -> TopoDS_Face:
    ring = [edges.foot_back, reversed_side(edges.seam_back)]
    face = maker.face(maker.spheroid(envelope.back), [ring], natural=False)
    maker.add_pcurves(face, ring)
    return face


def _seam_outline(front: FrontEdges, edges: CasingEdges) -> Ring:
    """Round the joining face x = 0, counter-clockwise from +x."""
    return [
        edges.wall[0],
        *front.chain(front.cells.boundary.seam),
        reversed_side(edges.wall[1]),
        edges.foot_end[1],
        reversed_side(edges.foot_step[1]),
        reversed_side(edges.seam_rim),
        edges.foot_step[0],
        reversed_side(edges.foot_end[0]),
    ]


def _foot_outline(front: FrontEdges, edges: CasingEdges) -> Ring:
    """Round the joining face z = foot, counter-clockwise from +z."""
    return [
        edges.foot_rim,
        edges.wall[1],
        *reversed_ring(front.chain(front.cells.boundary.foot)),
        reversed_side(edges.wall[0]),
    ]


def _seam_flange(edges: CasingEdges) -> Ring:
    """Round the seam flange's face toward the back."""
    return [
        edges.seam_step[0],
        edges.seam_back,
        reversed_side(edges.seam_step[1]),
        reversed_side(edges.seam_rim_back),
    ]


def _foot_flange(edges: CasingEdges) -> Ring:
    """Round the foot flange's top, on which the seam flange stands."""
    return [
        edges.foot_rim_top,
        reversed_side(edges.foot_step[1]),
        edges.seam_end[1],
        edges.seam_step[1],
        reversed_side(edges.foot_back),
        reversed_side(edges.seam_step[0]),
        reversed_side(edges.seam_end[0]),
        edges.foot_step[0],
    ]


def _rim(
    maker: Maker, arc: EllipseArc, along: Floats, rims: EndPair, ends: EndPair, outward: Floats
) -> TopoDS_Face:
    """Outer face of a flange, part of an elliptic cylinder; its middle looks outward."""
    middle = (arc.first + arc.last) / 2
    tangent = np.cos(middle) * arc.ellipse.minor - np.sin(middle) * arc.ellipse.major
    natural = bool(np.cross(tangent, along) @ outward > 0)
    near, far = rims
    ring = [ends[0], far, reversed_side(ends[1]), reversed_side(near)]
    # This ring turns about along x (low to high); the arc's parameter may run either way.
    if natural == (arc.last > arc.first):
        ring = reversed_ring(ring)
    face = maker.face(maker.extrusion(arc.ellipse, along), [ring], natural != maker.mirrored)
    height = float(np.linalg.norm(along))
    for (edge, _), v in zip(rims, (0.0, height), strict=True):
        maker.straight_pcurve(edge, face, (0.0, v), (1.0, 0.0))
    for (edge, _), u in zip(ends, (arc.first, arc.last), strict=True):
        maker.straight_pcurve(edge, face, (u, 0.0), (0.0, 1.0))
    return face
