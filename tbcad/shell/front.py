"""The mirrors' faces, on vertices and edges that neighbours share."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Vertex

from tbcad.cad.brep import Maker, Side
from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.cells import Arcs, Cells
from tbcad.optics.pedestals.cells import PedestalCells
from tbcad.optics.power_diagram import PLANES
from tbcad.shell.casing_edges import boundary_chain
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class FrontEdges:
    """Kernel vertices and edges of camera a's cells.

    Attributes:
        maker: that made them.
        cells: of the mirrors.
        vertices: by corner index.
        edges: by arc index.
    """

    maker: Maker
    cells: Cells
    vertices: dict[int, TopoDS_Vertex]
    edges: list[TopoDS_Edge]

    def faces(self) -> list[TopoDS_Face]:
        """One face for each cell, on its sphere or plane, in the order of the mirrors."""
        mirrors = self.cells.mirror_surfaces
        poses = zip(mirrors.apex, mirrors.normal, mirrors.radius, self._rings(), strict=True)
        return [self._face(*pose) for pose in poses]

    def _rings(self) -> list[list[Side]]:
        """Edges round each cell, counter-clockwise seen from the light, the solid's outer side."""
        offsets, sides = self.cells.rings
        every = self._edges(sides)
        return [every[a:b][::-1] for a, b in pairwise(offsets.tolist())]

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
