"""Where in the picture a mirror shows the rim of the object, and whether that is in the frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.surfaces import PreparedSurfaces, ReflectedRays, nearest_to_origin, reflect
from tbcad_verify.mesh.vectors import dot, norm, tangent_basis, unit
from tbcad_verify.record.export import Camera
from tbcad_verify.types import Floats

AZIMUTHS = 24
NEWTON = 12
CLOSE_MM = 1e-4


@dataclass(frozen=True)
class RimRays:
    """Camera rays that, off their mirror, graze the capture sphere: AZIMUTHS for each mirror."""

    mirror: NDArray[np.intp]  # (N,) recorded mirror
    direction: Floats  # (3, N) from the pinhole
    lines: ReflectedRays  # reflected
    error: Floats  # (N,) mm by which they fail to graze; NaN where no ray off the mirror would


def rim_rays(
    seen: PreparedSurfaces, mirrors: NDArray[np.intp], start: Floats, u: Floats, radius: Floats
) -> RimRays:
    """Aim at the rim of the capture sphere off each mirror, by Newton's method.

    Args:
        seen: the mirrors' surfaces from the pinhole.
        mirrors: (K,) which of them.
        start: (3, K) mm, a point on each mirror to begin with.
        u: (3, K) their virtual cameras' directions.
        radius: (K,) of the sphere about the origin to graze, mm.
    """
    chief = _aim(seen, mirrors, start - seen.origin[:, None], u, np.zeros((2, mirrors.size)))
    angle = np.tile(np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS), mirrors.size)
    index, u = np.repeat(mirrors, AZIMUTHS), np.repeat(u, AZIMUTHS, axis=1)
    target = np.repeat(radius, AZIMUTHS) * np.stack([np.cos(angle), np.sin(angle)])
    d = _aim(seen, index, np.repeat(chief, AZIMUTHS, axis=1), u, target)
    lines = reflect(seen, index, d)
    return RimRays(index, d, lines, np.asarray(np.hypot(*(_miss(lines, u) - target))))


def margins(camera: Camera, d: Floats) -> Floats:
    """(N,) pixels from where rays d (3, N) fall to the frame's nearest edge; < 0 outside."""
    depth = dot(camera.forward[:, None], d)
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.abs(dot(camera.right[:, None], d) / depth) / camera.pitch
        row = np.abs(dot(camera.down[:, None], d) / depth) / camera.pitch
    inside = np.minimum(camera.width / 2 - column, camera.height / 2 - row)
    return np.where(depth > 0, inside, -np.inf)


def _miss(lines: ReflectedRays, u: Floats) -> Floats:
    """(2, N) how a line misses the origin, across u; as long as the distance in space."""
    miss = nearest_to_origin(lines)
    flat = np.stack([dot(axis, miss) for axis in tangent_basis(u)])
    size = np.sqrt(np.maximum(np.einsum("in,in->n", flat, flat), 1e-300))
    return np.asarray(flat * (norm(miss) / size))


def _aim(
    seen: PreparedSurfaces, index: NDArray[np.intp], d: Floats, u: Floats, target: Floats
) -> Floats:
    """(3, N) rays whose reflected lines miss the origin by target (2, N)."""
    step = 1e-6
    for _ in range(NEWTON):
        axes = [norm(d) * axis for axis in tangent_basis(unit(d))]
        missed_by = _miss(reflect(seen, index, d), u)
        slopes = [
            (_miss(reflect(seen, index, d + step * axis), u) - missed_by) / step for axis in axes
        ]
        a, b = _solve(slopes, target - missed_by)
        d = d + a * axes[0] + b * axes[1]
    return d


def _solve(slopes: list[Floats], rest: Floats) -> tuple[Floats, Floats]:
    (p, q), (r, s) = slopes
    with np.errstate(divide="ignore", invalid="ignore"):
        det = p * s - q * r
        a, b = (s * rest[0] - r * rest[1]) / det, (p * rest[1] - q * rest[0]) / det
        # No step beyond a tenth of a radian: the far side of a small sphere is near.
        size = np.maximum(np.hypot(a, b) / 0.1, 1)
    return a / size, b / size
