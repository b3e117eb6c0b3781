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
from tbcad.shell.bores import bores
from tbcad.shell.boundary import boundary_chain, chain_ends
from tbcad.shell.envelope import Envelope
from tbcad.shell.front import Front
from tbcad.types import Floats

Pair = tuple[Side, Side]

X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Edges:
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
    seam_end: Pair
    foot_end: Pair
    seam_step: Pair
    foot_step: Pair
    wall: Pair


def casing_faces(front: Front, body: Envelope) -> list[tuple[str, TopoDS_Face]]:
    """Names and faces of everything but the mirrors."""
    maker, e = front.maker, _edges(front, body)
    seam_holes = bores(maker, body.seam_holes, Y, Z)
    foot_holes = bores(maker, body.foot_holes, X, Y)
    seam, foot, base = body.seam_thickness, body.foot_thickness, body.foot * Z
    seam_face = [reversed_ring(_seam_outline(front, e)), *seam_holes.near]
    foot_face = [reversed_ring(_foot_outline(front, e)), *foot_holes.near]
    return [
        ("back", _back(maker, body, e)),
        ("seam", maker.face(maker.plane(0 * X, -X), seam_face, natural=True)),
        ("foot", maker.face(maker.plane(base, -Z), foot_face, natural=True)),
        (
            "seam_flange",
            maker.face(maker.plane(seam, X), [_seam_flange(e), *seam_holes.far], natural=True),
        ),
        (
            "foot_flange",
            maker.face(maker.plane(base + foot, Z), [_foot_flange(e), *foot_holes.far], True),
        ),
        (
            "seam_rim",
            _rim(maker, body.seam_rim, seam, (e.seam_rim, e.seam_rim_back), e.seam_end, Z),
        ),
        ("foot_rim", _rim(maker, body.foot_rim, foot, (e.foot_rim, e.foot_rim_top), e.foot_end, X)),
        *((f"seam_hole_{k + 1:02d}", face) for k, face in enumerate(seam_holes.faces)),
        *((f"foot_hole_{k + 1:02d}", face) for k, face in enumerate(foot_holes.faces)),
    ]


def reversed_side(side: Side) -> Side:
    """The same edge followed the other way."""
    return side[0], not side[1]


def reversed_ring(ring: Ring) -> list[Side]:
    """The same ring the other way round."""
    return [reversed_side(side) for side in reversed(ring)]


def _edges(front: Front, body: Envelope) -> Edges:
    maker, cells = front.maker, front.cells
    seam_back = body.seam_rim.moved(body.seam_thickness)
    foot_top = body.foot_rim.moved(body.foot_thickness)
    corners = chain_ends(cells, boundary_chain(cells, cells.boundary.seam))
    points = {
        "front": [cells.corners[corner] for corner in corners],
        "back": _ends(body.seam_back),
        "seam": _ends(body.seam_rim),
        "seam_back": _ends(seam_back),
        "foot": _ends(body.foot_rim),
        "foot_top": _ends(foot_top),
    }
    vertices = {name: [maker.vertex(p) for p in pair] for name, pair in points.items()}
    vertices["front"] = [front.vertices[corner] for corner in corners]

    def lines(a: str, b: str) -> Pair:
        low, high = (
            maker.line(points[a][k], points[b][k], vertices[a][k], vertices[b][k]) for k in (0, 1)
        )
        return (low, True), (high, True)

    return Edges(
        seam_back=maker.ellipse_edge(body.seam_back, *vertices["back"]),
        foot_back=maker.ellipse_edge(body.foot_back, *vertices["back"]),
        seam_rim=maker.ellipse_edge(body.seam_rim, *vertices["seam"]),
        seam_rim_back=maker.ellipse_edge(seam_back, *vertices["seam_back"]),
        foot_rim=maker.ellipse_edge(body.foot_rim, *vertices["foot"]),
        foot_rim_top=maker.ellipse_edge(foot_top, *vertices["foot_top"]),
        seam_end=lines("seam", "seam_back"),
        foot_end=lines("foot", "foot_top"),
        seam_step=lines("seam_back", "back"),
        foot_step=lines("seam", "foot_top"),
        wall=lines("foot", "front"),
    )


def _ends(arc: EllipseArc) -> list[Floats]:
    return list(arc.at(np.array([0.0, 1.0])))


def _back(maker: Maker, body: Envelope, e: Edges) -> TopoDS_Face:
    ring = [e.foot_back, reversed_side(e.seam_back)]
    face = maker.face(maker.spheroid(body.back), [ring], natural=False)
    maker.add_pcurves(face, ring)
    return face


def _seam_outline(front: Front, e: Edges) -> Ring:
    """Round the joining face x = 0, counter-clockwise from +x."""
    return [
        e.wall[0],
        *front.chain(front.cells.boundary.seam),
        reversed_side(e.wall[1]),
        e.foot_end[1],
        reversed_side(e.foot_step[1]),
        reversed_side(e.seam_rim),
        e.foot_step[0],
        reversed_side(e.foot_end[0]),
    ]


def _foot_outline(front: Front, e: Edges) -> Ring:
    """Round the joining face z = foot, counter-clockwise from +z."""
    return [
        e.foot_rim,
        e.wall[1],
        *reversed_ring(front.chain(front.cells.boundary.foot)),
        reversed_side(e.wall[0]),
    ]


def _seam_flange(e: Edges) -> Ring:
    """Round the seam flange's face toward the back."""
    return [
        e.seam_step[0],
        e.seam_back,
        reversed_side(e.seam_step[1]),
        reversed_side(e.seam_rim_back),
    ]


def _foot_flange(e: Edges) -> Ring:
    """Round the foot flange's top, on which the seam flange stands."""
    return [
        e.foot_rim_top,
        reversed_side(e.foot_step[1]),
        e.seam_end[1],
        e.seam_step[1],
        reversed_side(e.foot_back),
        reversed_side(e.seam_step[0]),
        reversed_side(e.seam_end[0]),
        e.foot_step[0],
    ]


def _rim(
    maker: Maker, arc: EllipseArc, along: Floats, rims: Pair, ends: Pair, outward: Floats
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
