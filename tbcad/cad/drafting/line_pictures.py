"""Line pictures of meshes: sharp edges and outlines that are seen from a direction.

Hidden edges are removed by rays on meshes, in seconds; exact removal takes minutes.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from tbcad.cad.formats.entities import Layer, Line, Point
from tbcad.common.reuse import kept
from tbcad.types import Bools, Floats, Ints

SHARP_RAD = 0.6  # angle between faces that is drawn
OFF_MM = 0.05  # of a ray's start from its edge
DIGITS = 3

Bodies: TypeAlias = Mapping[str, trimesh.Trimesh]


@dataclass(frozen=True)
class LinePicture:
    """What is seen of bodies from a direction."""

    lines: tuple[Line, ...]  # visible edges, x to the right and y up, mm
    # of each body that is seen in thick lines: a visible point in its middle, mm
    anchors: dict[str, Point]


@kept("pictures")
def line_picture(bodies: Bodies, axes: Floats, piece: float) -> LinePicture:
    """Draw bodies, as `seen_lines` does, by a scene of its own."""
    return seen_lines(bodies, ray_scene(bodies), axes, piece)


def seen_lines(
    bodies: Bodies,
    rays: RayMeshIntersector,
    axes: Floats,
    piece: float,
    thin: Collection[str] = (),
) -> LinePicture:
    """Draw bodies.

    Args:
        bodies: closed meshes by name.
        rays: their `ray_scene`.
        axes: right, up and toward the eye, as rows, (3, 3).
        piece: longest piece of an edge that is tested as one, mm.
        thin: names of bodies that are drawn with fine lines.
    """
    names = sorted(bodies)
    lines: set[Line] = set()
    for name in names:
        layer = Layer.RAYS if name in thin else Layer.CUT
        lines.update(_visible(_pieces(bodies[name], axes[2], piece), rays, axes, layer))
    found = {name: _anchor(bodies[name], rays, axes) for name in names if name not in thin}
    anchors = {name: anchor for name, anchor in found.items() if anchor is not None}
    return LinePicture(tuple(sorted(lines, key=lambda one: (one.start, one.end))), anchors)


def ray_scene(bodies: Bodies) -> RayMeshIntersector:
    """All bodies for rays, in the order of their names."""
    return RayMeshIntersector(trimesh.util.concatenate([bodies[name] for name in sorted(bodies)]))


def _pieces(mesh: trimesh.Trimesh, eye: Floats, piece: float) -> tuple[Floats, Ints]:
    """Pieces of sharp edges and outlines: both ends and an outward direction, (n, 3, 3).

    And the number of each piece's edge, (n,); those of an edge are in order.
    """
    pairs, normals = mesh.face_adjacency, mesh.face_normals
    front = normals[pairs] @ eye
    outline = (front[:, 0] > 0) != (front[:, 1] > 0)
    drawn = (mesh.face_adjacency_angles > SHARP_RAD) | outline
    drawn &= (front > 0).any(axis=1)
    ends = mesh.vertices[mesh.face_adjacency_edges[drawn]]
    facing = (front > 0)[drawn, :, np.newaxis]  # others lie on what the body stands on
    out = (normals[pairs[drawn]] * facing).sum(axis=1)
    out /= np.maximum(np.linalg.norm(out, axis=1), 1e-9)[:, np.newaxis]
    count = np.ceil(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / piece).astype(int)
    return _split(ends, out, np.maximum(count, 1))


def _split(ends: Floats, out: Floats, count: Ints) -> tuple[Floats, Ints]:
    which = np.repeat(np.arange(len(ends)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    along = (ends[:, 1] - ends[:, 0])[which] / count[which][:, np.newaxis]
    start = ends[which, 0] + place[:, np.newaxis] * along
    return np.stack([start, start + along, out[which]], axis=1), which


def _visible(
    edges: tuple[Floats, Ints], rays: RayMeshIntersector, axes: Floats, layer: Layer
) -> list[Line]:
    """Lines of what is seen; pieces of an edge that follow each other are one."""
    pieces, which = edges
    if not len(pieces):
        return []
    start = pieces[:, :2].mean(axis=1) + OFF_MM * (pieces[:, 2] + axes[2])
    seen = ~_blocked(rays, start, axes[2])
    joined = seen[1:] & seen[:-1] & (which[1:] == which[:-1])
    first = seen & ~np.append(False, joined)
    last = seen & ~np.append(joined, False)
    ends = np.stack([pieces[first, 0], pieces[last, 1]], axis=1)
    flat = np.round(ends @ axes[:2].T, DIGITS) + 0.0
    pairs = (sorted(map(tuple, pair)) for pair in flat.tolist())
    return [Line(layer, start, end) for start, end in pairs]


def _blocked(rays: RayMeshIntersector, start: Floats, eye: Floats) -> Bools:
    return np.asarray(rays.intersects_any(start, np.broadcast_to(eye, start.shape)))


def _anchor(mesh: trimesh.Trimesh, rays: RayMeshIntersector, axes: Floats) -> Point | None:
    """The visible point of a body that is nearest to the middle of all visible ones."""
    facing = mesh.face_normals @ axes[2] > 0
    points = mesh.triangles_center[facing]
    if not len(points):
        return None
    seen = points[~_blocked(rays, points + OFF_MM * axes[2], axes[2])]
    if not len(seen):
        return None
    flat = seen @ axes[:2].T
    best = np.argmin(np.linalg.norm(flat - np.median(flat, axis=0), axis=1))
    x, y = np.round(flat[best], DIGITS).tolist()
    return x, y


def axes_toward(eye: Sequence[float] | Floats) -> Floats:
    """Right, up and toward the eye, as rows, (3, 3); up is z as far as it can be."""
    toward = np.array(eye) / np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])
