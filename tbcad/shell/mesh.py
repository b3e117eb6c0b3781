"""Triangles of a whole half: mirrors' facets and the casing's, on shared vertices."""

import manifold3d
import numpy as np

from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.geometry.conics import EllipseArc, Spheroid
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import dot
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.spec.design import Spec
from tbcad.shell.cell_outlines import CellOutlines, rows_and_columns
from tbcad.shell.envelope import ARC_ENDS, Envelope, Holes, boundary_chain, casing_lines, outline
from tbcad.shell.facets import Facets, mirror_facets
from tbcad.types import Floats, Ints

MIN_HOLE_SEGMENTS = 24
ROUNDED_DIGITS = 12  # joining faces are flat to the last bit: noise of 1e-15 mm is no geometry
X, Y, Z = np.eye(3)
# Coordinates in which a ring that runs counter-clockwise seen from +x, or +z, turns left.
FROM_X, FROM_Z = [1, 2], [0, 1]


def wall_facets(cells: PedestalCells, outlines: CellOutlines) -> Ints:
    """Triangles (t, 3) over the outlines' vertices, counter-clockwise seen from the light.

    Below the first half of its arc a wall fans out from the near end of the groove's bottom, below
    the second half from the far end.
    """
    arc, bottom = cells.wall_rings[:, 0] // 2, cells.wall_rings[:, 2]
    forward = bottom % 2 == 0
    ends = outlines.start[bottom // 2], outlines.end[bottom // 2]
    near, far = np.where(forward, ends, ends[::-1])
    half = outlines.segments[arc] // 2
    wall, k = rows_and_columns(outlines.segments[arc])
    tip = np.where(k < half[wall], near[wall], far[wall])
    here, after = (outlines.at(arc[wall], step) for step in (k, k + 1))
    middle = outlines.at(arc, half)
    fans = np.column_stack([here, after, tip])
    return np.concatenate([fans, np.column_stack([middle, far, near])])


def shell_mesh(spec: Spec, cells: Cells, envelope: Envelope, distance: Floats) -> Mesh:
    """Mesh of camera a's half within tolerances; distances of mirrors to the object (m,), mm."""
    builder, outlines = front_facets(spec, cells, distance)
    _add_casing(builder, cells, outlines, envelope)
    return builder.mesh()


def front_facets(spec: Spec, cells: Cells, distance: Floats) -> tuple["MeshBuilder", CellOutlines]:
    """A builder with the facets of mirrors and walls of pedestals, and the mirrors' outlines."""
    front = mirror_facets(spec, cells, distance)
    builder = MeshBuilder(front, spec.mesh.structure_error_mm)
    if isinstance(cells, PedestalCells):
        builder.triangles.append(wall_facets(cells, front.outlines))
    return builder, front.outlines


class MeshBuilder:
    """Vertices and triangles, collected face by face; curves within a chord error, mm."""

    def __init__(self, front: Facets, error: float) -> None:
        """Begin with the mirrors' facets."""
        self.error, self.points, self.triangles = error, front.vertices, [front.triangles]

    def mesh(self) -> Mesh:
        """The mesh of all faces."""
        vertices = np.round(self.points, ROUNDED_DIGITS) + 0.0
        return Mesh(vertices, np.concatenate(self.triangles))

    def add(self, points: Floats) -> Ints:
        """Indices of new vertices (k, 3)."""
        first = len(self.points)
        self.points = np.concatenate([self.points, points])
        return np.arange(first, len(self.points))

    def segments(self, angle: float, radius: float) -> int:
        """Segments for an arc of an angle (radians) and a radius (mm) within the chord error."""
        return int(np.ceil(angle * np.sqrt(radius / (8 * self.error))))

    def arc_segments(self, arc: EllipseArc) -> int:
        """Segments for an elliptic arc within the chord error."""
        longest = float(np.linalg.norm(arc.ellipse.major))
        return self.segments(abs(arc.last - arc.first), longest)

    def arc_between(self, ends: Ints, arc: EllipseArc, segments: int) -> Ints:
        """Vertices along an arc whose two ends are there already."""
        inner = self.add(arc.at(np.arange(1, segments) / segments))
        return np.concatenate([ends[:1], inner, ends[1:]])

    def arc_pair(self, arc: EllipseArc, along: Floats) -> tuple[Ints, Ints]:
        """Vertices along an arc, and along the same arc moved by a vector (3,)."""
        segments = self.arc_segments(arc)
        points = arc.at(np.arange(segments + 1) / segments)
        return self.add(points), self.add(points + along)

    def strip(self, first: Ints, second: Ints) -> None:
        """Quads between two lines of vertices; first to second turns left when followed."""
        a, b, c, d = first[:-1], first[1:], second[1:], second[:-1]
        self.triangles += [np.column_stack([a, d, c]), np.column_stack([a, c, b])]

    def spheroid(self, back: Spheroid, low: Ints, high: Ints) -> None:
        """The back between two lines that share their ends, by great circles of its sphere."""
        to_sphere = np.linalg.inv(back.from_sphere)
        a, b = ((self.points[line[1:-1]] - back.centre) @ to_sphere for line in (low, high))
        angle = np.arccos(np.clip(dot(a, b), -1, 1))[:, None]
        rows = self.segments(angle.max(), back.semi_axes[0])
        lines = [low]
        for share in np.arange(1, rows) / rows:
            point = (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)
            inner = self.add(back.centre + point @ back.from_sphere)
            lines.append(np.concatenate([low[:1], inner, low[-1:]]))
        for lower, upper in zip(lines, [*lines[1:], high], strict=True):
            self.strip(upper, lower)
            for k in (-2, -1):  # quads at the shared ends are triangles
                a, b, c = self.triangles[k].T
                self.triangles[k] = self.triangles[k][(a != b) & (b != c) & (c != a)]

    def holes(self, holes: Holes, axes: Floats) -> tuple[list[Ints], list[Ints]]:
        """Cylinders of holes; rings on the joining face and on the far one, turning right."""
        near, far = [], []
        for centre, radius in zip(holes.centre, holes.radius, strict=True):
            count = max(MIN_HOLE_SEGMENTS, self.segments(2 * np.pi, radius))
            ring = centre + radius * unit_circle(-even_angles(count)) @ axes
            near.append(self.add(ring))
            far.append(self.add(ring + holes.direction))
            self.strip(np.append(far[-1], far[-1][0]), np.append(near[-1], near[-1][0]))
        return near, far

    def plane(self, view: list[int], ring: Ints, holes: list[Ints], away: bool = False) -> None:
        """A planar face with holes; away: it looks away from the view.

        In the two coordinates of the view the outer ring turns left and the holes right.
        """
        rings = [ring, *holes]
        polygons = [self.points[ring][:, view] for ring in rings]
        triangles = np.concatenate(rings)[np.asarray(manifold3d.triangulate(polygons))]
        self.triangles.append(triangles[:, ::-1] if away else triangles)


def _add_casing(
    builder: MeshBuilder, cells: Cells, outlines: CellOutlines, envelope: Envelope
) -> None:
    """Back, flanges, rims and holes: all faces but the mirrors'."""
    edges = _edges(builder, cells, outlines, envelope)

    def ring(face: str) -> Ints:
        lines = outline(face, edges, lambda line: line[::-1])
        return np.concatenate([line[:-1] for line in lines])

    builder.spheroid(envelope.back, edges["foot_back"], edges["seam_back"])
    builder.strip(edges["seam_rim"], edges["seam_rim_back"])
    builder.strip(edges["foot_rim_top"], edges["foot_rim"])
    seam_near, seam_far = builder.holes(envelope.seam_holes, np.stack([Y, Z]))
    foot_near, foot_far = builder.holes(envelope.foot_holes, np.stack([X, Y]))
    builder.plane(FROM_X, ring("seam_flange"), seam_far)
    builder.plane(FROM_Z, ring("foot_flange"), foot_far)
    builder.plane(FROM_X, ring("seam"), seam_near, away=True)
    builder.plane(FROM_Z, ring("foot"), foot_near, away=True)


def _edges(
    builder: MeshBuilder, cells: Cells, outlines: CellOutlines, envelope: Envelope
) -> dict[str, Ints]:
    """Vertices along the edges of the casing, by the names of casing_edges."""
    backs = envelope.seam_back, envelope.foot_back
    back_ends = builder.add(envelope.seam_back.at(np.array([0.0, 1.0])))
    segments = max(builder.arc_segments(arc) for arc in backs)
    seam_back, foot_back = (builder.arc_between(back_ends, arc, segments) for arc in backs)
    seam_rim, seam_rim_back = builder.arc_pair(envelope.seam_rim, envelope.seam_thickness)
    foot_rim, foot_rim_top = builder.arc_pair(envelope.foot_rim, envelope.foot_thickness)
    curves = {
        "seam_back": seam_back,
        "foot_back": foot_back,
        "seam_rim": seam_rim,
        "seam_rim_back": seam_rim_back,
        "foot_rim": foot_rim,
        "foot_rim_top": foot_rim_top,
        "seam_front": outlines.along(boundary_chain(cells, cells.seam)),
        "foot_front": outlines.along(boundary_chain(cells, cells.foot)),
    }
    ends = {ARC_ENDS[name]: curves[name][[0, -1]] for name in ARC_ENDS}
    ends["front"] = curves["seam_front"][[0, -1]]
    return curves | casing_lines(lambda a, b, k: np.array([ends[a][k], ends[b][k]]))
