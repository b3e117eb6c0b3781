"""View by a mirror: rays from the pinhole to the edge of the mirror, reflected.

The outline of a mirror is made of the mesh edges that separate its patch from others. The minimum
distance from the origin of all rays reflected there is half the coverage diameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.fits import SurfaceFits
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.rays import RayScene
from tbcad_verify.mesh.surfaces import (
    PreparedSurfaces,
    ReflectedRays,
    Surfaces,
    nearest_to_origin,
    reflect,
    reflect_directions,
)
from tbcad_verify.mesh.vectors import distances_to_segments, dot, norm, rotation_angles, unit
from tbcad_verify.record.poses import VirtualCameras
from tbcad_verify.shell.recover import Recovery, follows_fit
from tbcad_verify.types import Bools, Floats, Ints

SAMPLES = np.linspace(0.0, 1.0, 4)
SEAM_MM = 1e-6
NEWTON = 5


@dataclass(frozen=True)
class Outline:
    """The outlines of all mirrors of one camera, cut into N samples, edge by edge."""

    mirror: Ints  # (N,) recorded mirror
    facet: Ints  # (N,) the facet inside the mirror, at its edge
    on_mesh: Floats  # (3, N) mm, on the mesh edge
    inside: Floats  # (3, N) mm, a little inside the facet
    point: Floats  # (3, N) mm, where the edge is on the reflecting surface, above the coat
    seam: NDArray[np.bool_]  # (N,) true on the cut of a halved mirror along x = 0


def trace_outline(
    mesh: Mesh,
    recovery: Recovery,
    owner: Ints,
    coating_mm: float,
    selected: NDArray[np.bool_],
    halved: NDArray[np.bool_],
) -> Outline:
    """Sample the outlines of selected mirrors.

    `owner`: (K,) recorded mirror of each patch, -1 for none.
    `selected`: (M,) true for mirrors of the camera in question.
    `halved`: (M,) true for mirrors that the seam cuts.
    """
    label = recovery.segments.label
    half, beyond = _outline_edges(mesh, label, owner, selected)
    corner = mesh.faces.reshape(-1)
    facet, k = np.divmod(half, 3)
    start, end, far = (mesh.points[corner[3 * facet + (k + j) % 3]].T for j in range(3))
    on_mesh = (start[..., None] + (end - start)[..., None] * SAMPLES).reshape(3, -1)
    many = SAMPLES.size
    height = np.repeat(_height(start, end, far), many)
    mirror = owner[label[facet]]
    seam = halved[mirror] & (np.abs(start[0]) < SEAM_MM) & (np.abs(end[0]) < SEAM_MM)
    middle = np.repeat((start + end + far) / 3, many, axis=1)
    sides = np.repeat(label[facet], many), np.repeat(beyond, many)
    point = on_mesh
    if coating_mm > 0:
        point = _onto_coats(recovery.fits, owner >= 0, coating_mm, sides, on_mesh)
    return Outline(
        np.repeat(mirror, many),
        np.repeat(facet, many),
        on_mesh,
        on_mesh + _nudge(height) * (middle - on_mesh),
        point,
        np.repeat(seam, many),
    )


def reflect_on_facets(outline: Outline, pinhole: Floats, scene: RayScene) -> ReflectedRays:
    """Reflect each sample's ray on its facet's own normal."""
    d = outline.point - pinhole[:, None]
    normal = scene.plane(outline.facet)[:3]
    return ReflectedRays(outline.point, reflect_directions(d, normal), np.ones(d.shape[1]))


def reflect_on_fits(outline: Outline, seen: PreparedSurfaces) -> ReflectedRays:
    """Reflect each sample's ray on its mirror's fitted surface, coat included."""
    return reflect(seen, outline.mirror, outline.point - seen.origin[:, None])


def minimum_miss_distance(
    outline: Outline, lines: ReflectedRays, virtual: VirtualCameras
) -> Floats:
    """(V,) minimum distance from the origin over each virtual camera's outer edges, mm; inf: none.

    Between samples the image of an edge is taken for straight, as it is for a flat facet.
    """
    outer = np.flatnonzero(~outline.seam[:: SAMPLES.size])
    at = nearest_to_origin(lines).reshape(3, -1, SAMPLES.size)[:, outer]
    start, end = at[:, :, :-1].reshape(3, -1), at[:, :, 1:].reshape(3, -1)
    miss = distances_to_segments(np.zeros_like(start), start, end)
    camera = virtual.index[outline.mirror[:: SAMPLES.size][outer]]
    minimum = np.full(virtual.count, np.inf)
    # A ray that passes its mirror by sees nothing of the object.
    np.minimum.at(minimum, np.repeat(camera, SAMPLES.size - 1), np.nan_to_num(miss, nan=0.0))
    return minimum


def winding_numbers(
    outline: Outline, lines: ReflectedRays, virtual: VirtualCameras, u: Floats
) -> Floats:
    """(V,) how often each virtual camera's reflected outline runs round the origin.

    The sign is dropped. What is not about 1 does not surround the object's middle at all, however
    far from it. The cut between two halves is left out: it runs through the middle.

    `u`: (3, M) directions of the virtual cameras.
    """
    axis = u[:, outline.mirror]
    # Across each ray, turned with it to lie across the axis: a ray at a right angle to the axis
    # may meet it far from the origin.
    across = _turned(nearest_to_origin(lines), -unit(lines.toward), axis)
    miss = across.reshape(3, -1, SAMPLES.size)
    start, end = miss[:, :, :-1].reshape(3, -1), miss[:, :, 1:].reshape(3, -1)
    edge_mirror = outline.mirror[:: SAMPLES.size]
    axis = np.repeat(u[:, edge_mirror], SAMPLES.size - 1, axis=1)
    angle = rotation_angles(axis, start, end).reshape(-1, SAMPLES.size - 1).sum(axis=1)
    angle = np.where(outline.seam[:: SAMPLES.size], 0.0, np.nan_to_num(angle))
    return np.bincount(virtual.index[edge_mirror], angle, virtual.count) / (2 * np.pi)


def _turned(vector: Floats, start: Floats, end: Floats) -> Floats:
    """Vectors across directions `start`, by the smallest turns that take those to `end`."""
    share = dot(vector, end) / (1 + dot(start, end))
    return np.asarray(vector - share * (start + end))


def _outline_edges(
    mesh: Mesh, label: NDArray[np.int32], owner: Ints, selected: NDArray[np.bool_]
) -> tuple[Ints, Ints]:
    """Half-edges inside selected mirrors' outlines, and the patch beyond each (-1: none)."""
    mirror = owner[label]
    facets = np.flatnonzero((mirror >= 0) & selected[mirror])
    half = (3 * facets[:, None] + np.arange(3)).ravel()
    twin = mesh.twin[half]
    beyond = np.where(twin >= 0, label[twin // 3], -1)
    edge = beyond != label[half // 3]
    return half[edge], beyond[edge].astype(np.intp)


def _height(start: Floats, end: Floats, far: Floats) -> Floats:
    edge, side = end - start, far - start
    along = dot(side, edge) / np.maximum(dot(edge, edge), 1e-300)
    return norm(side - along * edge)


def _nudge(height: Floats) -> Floats:
    # 2 % of the distance to the facet's centre, at least 0.2 micrometres: Embree rounds to 0.02.
    return np.clip(2e-4 / np.maximum(height / 3, 1e-12), 0.02, 0.5)


def _onto_coats(
    fits: SurfaceFits,
    coated: Bools,
    coat: float,
    sides: tuple[NDArray[np.integer], Ints],
    x: Floats,
) -> Floats:
    """Move edge points to where the coated surfaces of both sides meet; walls have no coat."""
    inside, beyond = sides
    surface = fits.surfaces.take(inside).coated(coat)
    both = (beyond >= 0) & follows_fit(fits)[beyond]
    facing = np.where(both, beyond, inside)
    other = fits.surfaces.take(facing).coated(np.where(coated[facing], coat, 0.0))
    for _ in range(NEWTON):
        x = x - _least_step(surface, other, both, x)
    return x


def _least_step(surface: Surfaces, other: Surfaces, both: NDArray[np.bool_], x: Floats) -> Floats:
    """The shortest move that puts x on its own surface and, where there are both, the other."""
    f, g = surface.height(x), other.height(x)
    m, n = surface.gradient(x), other.gradient(x)
    c = np.where(both, dot(m, n), 0.0)
    rest = np.maximum(1 - c * c, 1e-12)
    a, b = (f - c * g) / rest, (g - c * f) / rest
    return np.where(both, a * m + b * n, f * m)
