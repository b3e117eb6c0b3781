"""The shell's faces: the mirrors', and behind them back, joining faces, flanges, rims and holes.

Neighbours share vertices and edges.
"""

from dataclasses import dataclass
from itertools import chain, pairwise

import numpy as np
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Vertex

from tbcad.cad.kernel.brep import Maker, Ring, Side, hole_faces
from tbcad.core.geometry.conics import EllipseArc
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.cells import Arcs, Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.shell.envelope import (
    ARC_ENDS,
    Envelope,
    boundary_chain,
    casing_arcs,
    casing_lines,
    chain_ends,
    outline,
)
from tbcad.types import Floats, Ints

Edges = dict[str, list[Side]]
"""Edges of the casing by the names of casing_edges, arcs from low to high y."""
X, Y, Z = np.eye(3)
FAR_RIMS = {"seam": "seam_rim_back", "foot": "foot_rim_top"}


@dataclass(frozen=True)
class FrontEdges:
    """Kernel vertices and edges of camera a's cells."""

    maker: Maker  # that made them
    cells: Cells  # of the mirrors
    vertices: dict[int, TopoDS_Vertex]  # by corner index
    edges: list[TopoDS_Edge]  # by arc index

    def faces(self) -> list[TopoDS_Face]:
        """One face for each cell, on its sphere or plane, in the order of the mirrors."""
        mirrors = self.cells.mirror_surfaces
        offsets, sides = self.cells.rings
        every = self._edges(sides)
        # Counter-clockwise seen from the light, the solid's outer side.
        rings = (every[a:b][::-1] for a, b in pairwise(offsets.tolist()))
        poses = zip(mirrors.apex, mirrors.normal, mirrors.radius, rings, strict=True)
        return [self._face(*pose) for pose in poses]

    def walls(self) -> list[TopoDS_Face]:
        """Faces of the walls below mirrors on pedestals, none where neighbouring spheres meet."""
        cells, maker = self.cells, self.maker
        if not isinstance(cells, PedestalCells):
            return []
        surfaces = cells.surfaces.subset(slice(cells.mirrors + PLANES, None))
        poses = zip(surfaces.apex, surfaces.normal, cells.wall_rings, strict=True)
        return [
            maker.face(maker.plane(point, normal), [self._edges(sides)[::-1]], natural=True)
            for point, normal, sides in poses
        ]

    def _edges(self, sides: Ints) -> list[Side]:
        """Sides as edges, each followed the other way: seen from the light rings turn back."""
        return [(self.edges[side // 2], bool(side % 2)) for side in sides.tolist()]

    def _face(self, apex: Floats, normal: Floats, radius: float, ring: list[Side]) -> TopoDS_Face:
        maker = self.maker
        if np.isnan(radius):
            return maker.face(maker.plane(apex, normal), [ring], natural=True)
        sphere = maker.sphere(apex - radius * normal, radius, normal)
        face = maker.face(sphere, [ring], natural=True)
        maker.add_pcurves(face, ring)
        return face

    def chain(self, plane: int) -> list[Side]:
        """Edges along the seam or the foot, from low to high y."""
        return [(self.edges[arc], forward) for arc, forward in boundary_chain(self.cells, plane)]


def front_edges(maker: Maker, cells: Cells) -> FrontEdges:
    """Vertices at the corners and an edge for each arc."""
    arcs = cells.arcs
    used = np.unique(np.concatenate([arcs.start, arcs.end])).tolist()
    vertices = {corner: maker.vertex(cells.corners[corner]) for corner in used}
    edges = []
    for k, (centre, x, y, radius, angle) in enumerate(zip(*_circles(arcs), strict=True)):
        start, end = vertices[int(arcs.start[k])], vertices[int(arcs.end[k])]
        if angle == 0:
            edges.append(maker.line(arcs.points[k, 0], arcs.points[k, 2], start, end))
        else:
            edges.append(maker.circle(centre, x, y, radius, angle, start, end))
    return FrontEdges(maker, cells, vertices, edges)


def _circles(arcs: Arcs) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Circles of e arcs from their control polygons: centre, axes x and y, radius and angle.

    Each runs from centre + radius x by the angle toward y; the angle of straight ones is 0.
    """
    start, control, end = (arcs.points[:, k] for k in range(3))
    along = unit(control - start)
    half = norm(end - start) / 2
    straight = arcs.weight == 1
    sine = np.sqrt(1 - arcs.weight**2)
    radius = np.divide(half, sine, out=np.ones_like(half), where=~straight)
    chord = (end - start) / (2 * half[:, None])
    outward = unit(along - dot(along, chord)[:, None] * chord)
    x = arcs.weight[:, None] * outward - sine[:, None] * chord
    angle = np.where(straight, 0.0, 2 * np.arcsin(np.minimum(sine, 1)))
    return start - radius[:, None] * x, x, along, radius, angle


def casing_faces(front: FrontEdges, envelope: Envelope) -> list[tuple[str, TopoDS_Face]]:
    """Names and faces of everything but the mirrors."""
    maker, edges = front.maker, _edges(front, envelope)
    seam_near, seam_far, seam_walls = hole_faces(maker, *envelope.seam_holes.sizes, Y, Z)
    foot_near, foot_far, foot_walls = hole_faces(maker, *envelope.foot_holes.sizes, X, Y)
    seam, foot, base = envelope.seam_thickness, envelope.foot_thickness, envelope.foot * Z

    def ring(face: str) -> list[Side]:
        sides: list[list[Side]] = outline(face, edges, reversed_ring)
        return list(chain.from_iterable(sides))

    def plane(point: Floats, normal: Floats, *rings: Ring) -> TopoDS_Face:
        return maker.face(maker.plane(point, normal), rings, natural=True)

    return [
        ("back", _back(maker, envelope, edges)),
        ("seam", plane(0 * X, -X, reversed_ring(ring("seam")), *seam_near)),
        ("foot", plane(base, -Z, reversed_ring(ring("foot")), *foot_near)),
        ("seam_flange", plane(seam, X, ring("seam_flange"), *seam_far)),
        ("foot_flange", plane(base + foot, Z, ring("foot_flange"), *foot_far)),
        ("seam_rim", _rim(maker, "seam", envelope.seam_rim, seam, edges, outward=Z)),
        ("foot_rim", _rim(maker, "foot", envelope.foot_rim, foot, edges, outward=X)),
        *((f"seam_hole_{k + 1:02d}", face) for k, face in enumerate(seam_walls)),
        *((f"foot_hole_{k + 1:02d}", face) for k, face in enumerate(foot_walls)),
    ]


def reversed_ring(ring: Ring) -> list[Side]:
    """The same edges followed the other way round."""
    return [(edge, not forward) for edge, forward in reversed(ring)]


def _edges(front: FrontEdges, envelope: Envelope) -> Edges:
    maker, cells, arcs = front.maker, front.cells, casing_arcs(envelope)
    corners = chain_ends(cells, boundary_chain(cells, cells.seam))
    points: dict[str, Floats] = {}
    for name, arc in arcs.items():
        points.setdefault(ARC_ENDS[name], arc.at(np.array([0.0, 1.0])))
    vertices = {name: [maker.vertex(end) for end in ends] for name, ends in points.items()}
    points["front"] = cells.corners[list(corners)]
    vertices["front"] = [front.vertices[corner] for corner in corners]

    def line(first: str, last: str, k: int) -> list[Side]:
        ends = points[first][k], points[last][k], vertices[first][k], vertices[last][k]
        return [(maker.line(*ends), True)]

    curves = {
        name: [maker.ellipse_edge(arc, *vertices[ARC_ENDS[name]])] for name, arc in arcs.items()
    }
    return {
        **curves,
        **casing_lines(line),
        "seam_front": front.chain(cells.seam),
        "foot_front": front.chain(cells.foot),
    }


def _back(maker: Maker, envelope: Envelope, edges: Edges) -> TopoDS_Face:
    ring = [*edges["foot_back"], *reversed_ring(edges["seam_back"])]
    face = maker.face(maker.spheroid(envelope.back), [ring], natural=False)
    maker.add_pcurves(face, ring)
    return face


def _rim(
    maker: Maker, flange: str, arc: EllipseArc, along: Floats, edges: Edges, outward: Floats
) -> TopoDS_Face:
    """Outer face of a flange, part of an elliptic cylinder; its middle looks outward."""
    middle = (arc.first + arc.last) / 2
    tangent = np.cos(middle) * arc.ellipse.minor - np.sin(middle) * arc.ellipse.major
    natural = bool(np.cross(tangent, along) @ outward > 0)
    [near], [far] = edges[f"{flange}_rim"], edges[FAR_RIMS[flange]]
    [low], [high] = edges[f"{flange}_end_low"], edges[f"{flange}_end_high"]
    ring = [low, far, *reversed_ring([near, high])]
    # This ring turns about along x (low to high); the arc's parameter may run either way.
    if natural == (arc.last > arc.first):
        ring = reversed_ring(ring)
    face = maker.face(maker.extrusion(arc.ellipse, along), [ring], natural != maker.mirrored)
    height = float(np.linalg.norm(along))
    for (edge, _), v in ((near, 0.0), (far, height)):
        maker.straight_pcurve(edge, face, (0.0, v), (1.0, 0.0))
    for (edge, _), u in ((low, arc.first), (high, arc.last)):
        maker.straight_pcurve(edge, face, (u, 0.0), (0.0, 1.0))
    return face
