"""Edges of many bodies without those that are hidden: by rays on meshes, as fast as they are many.

Exact removal takes minutes for an assembly; on its meshes it takes seconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from tbcad.cad.projection import Segment
from tbcad.types import Bools, Floats, Ints

SHARP_RAD = 0.6  # angle between faces that is drawn
OFF_MM = 0.05  # of a ray's start from its edge
DIGITS = 3


@dataclass(frozen=True)
class LinePicture:
    """What is seen of bodies from a direction.

    Attributes:
        lines: visible edges, x to the right and y up, mm.
        anchors: of each body that is seen: a visible point in its middle, mm.
    """

    lines: tuple[Segment, ...]
    anchors: dict[str, tuple[float, float]]


def line_picture(bodies: Mapping[str, trimesh.Trimesh], axes: Floats, piece: float) -> LinePicture:
    """Draw bodies.

    Args:
        bodies: meshes in mm by name.
        axes: right, up and toward the eye, as rows, (3, 3).
        piece: longest piece of an edge that is tested as one, mm.
    """
    names = sorted(bodies)
    whole = trimesh.util.concatenate([bodies[name] for name in names])
    rays = RayMeshIntersector(whole)
    lines: set[Segment] = set()
    for name in names:
        lines.update(_visible(_pieces(bodies[name], axes[2], piece), rays, axes))
    found = {name: _anchor(bodies[name], rays, axes) for name in names}
    anchors = {name: anchor for name, anchor in found.items() if anchor is not None}
    return LinePicture(tuple(sorted(lines)), anchors)


def _pieces(mesh: trimesh.Trimesh, eye: Floats, piece: float) -> Floats:
    """Pieces of sharp edges and outlines: both ends and an outward direction, (n, 3, 3)."""
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


def _split(ends: Floats, out: Floats, count: Ints) -> Floats:
    which = np.repeat(np.arange(len(ends)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    along = (ends[:, 1] - ends[:, 0])[which] / count[which][:, np.newaxis]
    start = ends[which, 0] + place[:, np.newaxis] * along
    return np.stack([start, start + along, out[which]], axis=1)


def _visible(pieces: Floats, rays: RayMeshIntersector, axes: Floats) -> list[Segment]:
    if not len(pieces):
        return []
    start = pieces[:, :2].mean(axis=1) + OFF_MM * (pieces[:, 2] + axes[2])
    seen = ~_blocked(rays, start, axes[2])
    flat = np.round(pieces[seen, :2] @ axes[:2].T, DIGITS) + 0.0
    return [Segment(*sorted(((ax, ay), (bx, by)))) for (ax, ay), (bx, by) in flat.tolist()]


def _blocked(rays: RayMeshIntersector, start: Floats, eye: Floats) -> Bools:
    return np.asarray(rays.intersects_any(start, np.broadcast_to(eye, start.shape)))


def _anchor(
    mesh: trimesh.Trimesh, rays: RayMeshIntersector, axes: Floats
) -> tuple[float, float] | None:
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
