"""Triangles of a whole half: mirrors' facets and the body's, on shared vertices."""

from collections.abc import Sequence

import manifold3d
import numpy as np

from tbcad.cad.mesh import Mesh
from tbcad.geometry.conics import EllipseArc, Spheroid
from tbcad.geometry.vectors import dot
from tbcad.optics.cells import Cells
from tbcad.shell.boundary import boundary_chain
from tbcad.shell.envelope import Envelope, Holes
from tbcad.shell.facets import Facets, mirror_facets
from tbcad.spec.design import Spec
from tbcad.types import Floats, Ints

LEAST_AROUND_HOLE = 24


def shell_mesh(spec: Spec, cells: Cells, body: Envelope, distance: Floats) -> Mesh:
    """Mesh of camera a's half.

    Args:
        spec: design with the mesh tolerances.
        cells: camera a's cells of the modelled surfaces.
        body: what closes them.
        distance: from each mirror to the object, mm, (m,).
    """
    front = mirror_facets(spec, cells, distance)
    skin = _Skin(spec.mesh.structure_error_mm, cells, front, body)
    points = np.concatenate([front.vertices, *skin.points])
    # Joining faces are flat to the last bit: rounding noise of 1e-15 mm is no geometry.
    return Mesh(np.round(points, 12) + 0.0, np.concatenate([front.triangles, *skin.triangles]))


class _Skin:
    """Vertices and triangles of the body, collected face by face."""

    def __init__(self, error: float, cells: Cells, front: Facets, body: Envelope) -> None:
        self.error, self.points, self.triangles = error, [front.vertices[:0]], [front.triangles[:0]]
        self.front, self.count = front, len(front.vertices)
        seam, foot = body.seam_thickness, body.foot_thickness
        plan_x, plan_z = [1, 2], [0, 1]  # (y, z) seen from +x and (x, y) from +z turn left

        ends = self.add(body.seam_back.at(np.array([0.0, 1.0])))
        steps = max(self.steps(arc) for arc in (body.seam_back, body.foot_back))
        seam_back, foot_back = (
            self.between(ends, arc, steps) for arc in (body.seam_back, body.foot_back)
        )
        seam_rim, seam_rim_back = self.pair(body.seam_rim, seam)
        foot_rim, foot_rim_top = self.pair(body.foot_rim, foot)
        self.grid(body.back, foot_back, seam_back)
        self.strip(seam_rim, seam_rim_back)
        self.strip(foot_rim_top, foot_rim)

        seam_near, seam_far = self.bores(body.seam_holes, np.array([[0, 1.0, 0], [0, 0, 1.0]]))
        foot_near, foot_far = self.bores(body.foot_holes, np.array([[1.0, 0, 0], [0, 1.0, 0]]))
        seam_front = front.along(boundary_chain(cells, cells.boundary.seam))
        foot_front = front.along(boundary_chain(cells, cells.boundary.foot))
        low, high = [0], [-1]
        joined = np.concatenate
        self.plane(plan_x, [joined([seam_back, seam_rim_back[::-1]]), *seam_far])
        top = [
            foot_rim_top,
            seam_rim[high],
            seam_rim_back[high],
            foot_back[::-1],
            seam_rim_back[low],
            seam_rim[low],
        ]
        self.plane(plan_z, [joined(top), *foot_far])
        wall = [
            foot_rim[low],
            seam_front,
            foot_rim[high],
            foot_rim_top[high],
            seam_rim[::-1],
            foot_rim_top[low],
        ]
        self.plane(plan_x, [joined(wall), *seam_near], turned=True)
        self.plane(plan_z, [joined([foot_rim, foot_front[::-1]]), *foot_near], turned=True)

    def add(self, points: Floats) -> Ints:
        """Indices of new vertices (k, 3)."""
        self.points.append(points)
        self.count += len(points)
        return np.arange(self.count - len(points), self.count)

    def vertices(self, ids: Ints) -> Floats:
        """Points of vertices by index."""
        result: Floats = np.concatenate([self.front.vertices, *self.points])[ids]
        return result

    def steps(self, arc: EllipseArc) -> int:
        """Segments for an elliptic arc within the tolerance."""
        longest = float(np.linalg.norm(arc.ellipse.major))
        return int(np.ceil(abs(arc.last - arc.first) * np.sqrt(longest / (8 * self.error))))

    def between(self, ends: Ints, arc: EllipseArc, steps: int) -> Ints:
        """Vertices along an arc whose ends are there already."""
        inner = self.add(arc.at(np.arange(1, steps) / steps))
        return np.concatenate([ends[:1], inner, ends[1:]])

    def pair(self, arc: EllipseArc, along: Floats) -> tuple[Ints, Ints]:
        """Vertices along an arc and along the same arc moved through a flange."""
        steps = self.steps(arc)
        points = arc.at(np.arange(steps + 1) / steps)
        return self.add(points), self.add(points + along)

    def strip(self, first: Ints, second: Ints) -> None:
        """Quads between two lines of vertices; first to second turns left when followed."""
        a, b, c, d = first[:-1], first[1:], second[1:], second[:-1]
        self.triangles += [np.column_stack([a, d, c]), np.column_stack([a, c, b])]

    def grid(self, back: Spheroid, low: Ints, high: Ints) -> None:
        """The back between two lines that share their ends, by great circles of its sphere."""
        to_sphere = np.linalg.inv(back.from_sphere)
        a = (self.vertices(low[1:-1]) - back.centre) @ to_sphere
        b = (self.vertices(high[1:-1]) - back.centre) @ to_sphere
        angle = np.arccos(np.clip(dot(a, b), -1, 1))[:, None]
        rows = int(np.ceil(angle.max() * np.sqrt(back.semi_axes[0] / (8 * self.error))))
        lines = [low]
        for share in np.arange(1, rows) / rows:
            point = (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)
            inner = self.add(back.centre + point @ back.from_sphere)
            lines.append(np.concatenate([low[:1], inner, low[-1:]]))
        for lower, upper in zip(lines, [*lines[1:], high], strict=True):
            self.strip(upper, lower)
            for k in (-2, -1):  # quads at the shared ends are triangles
                self.triangles[k] = _proper(self.triangles[k])

    def bores(self, holes: Holes, axes: Floats) -> tuple[list[Ints], list[Ints]]:
        """Cylinders of holes; rings on the joining face and on the far one, turning right."""
        near, far = [], []
        for centre, radius in zip(holes.centre, holes.radius, strict=True):
            count = max(
                LEAST_AROUND_HOLE, int(np.ceil(2 * np.pi * np.sqrt(radius / (8 * self.error))))
            )
            turn = -2 * np.pi * np.arange(count) / count
            ring = centre + radius * np.column_stack([np.cos(turn), np.sin(turn)]) @ axes
            near.append(self.add(ring))
            far.append(self.add(ring + holes.direction))
            self.strip(np.append(far[-1], far[-1][0]), np.append(near[-1], near[-1][0]))
        return near, far

    def plane(self, plan: Sequence[int], rings: Sequence[Ints], turned: bool = False) -> None:
        """A planar face: outer ring turning left, holes right, in two of the coordinates."""
        ids = np.concatenate(rings)
        polygons = [self.vertices(ring)[:, plan] for ring in rings]
        triangles = ids[np.asarray(manifold3d.triangulate(polygons))]
        self.triangles.append(triangles[:, ::-1] if turned else triangles)


def _proper(triangles: Ints) -> Ints:
    a, b, c = triangles.T
    result: Ints = triangles[(a != b) & (b != c) & (c != a)]
    return result
