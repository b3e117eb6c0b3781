"""Rays of the shell's picture on the balls: rotated as the picture is, reflected, obstructed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad_verify.mesh.rays import RAYS_A_CHUNK, in_threads
from tbcad_verify.mesh.surfaces import ReflectedRays, nearest_on_rays, reflect
from tbcad_verify.mesh.vectors import (
    chunks,
    distances_to_segments,
    dot,
    norm,
    polar_and_azimuth,
    unit,
)
from tbcad_verify.prototype.bodies import BodyScene, MeasuredPrototype
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.types import Bools, Floats, Ints

LIFT_MM = 1e-3
# Parts that reach into the capture sphere by less than this, as the object itself may, pass.
GRAZE_MM = 0.01
# A cap's facets lie this near to the sphere that they approximate.
SKIN_MM = 0.1

Hits = Iterator[tuple[Bools, str]]  # which of N rays something stops, and its name


class Reflecting(Protocol):
    """What takes directions of the shell's picture to rays after the balls."""

    def reflected(self, mirror: Ints, d: Floats) -> tuple[Floats, ReflectedRays]:
        """Directions (3, N) of mirrors' cells as they meet the balls, and their reflections."""


@dataclass(frozen=True)
class RayTransfer:
    """What takes directions of the shell's picture to rays on the balls, for m mirrors."""

    measured: MeasuredPrototype  # balls and obstacles
    # (3, 3, m) rotates directions of a mirror's cell in the shell's picture to where the merged
    # picture has them on the mirror's ball
    merged: Floats
    on_base: Floats  # (3, 3, m) the same, to the frame of the base at the mirror's stop
    ball: Ints  # (m,) that substitutes for the mirror
    base: Rotation  # m rotations of the base

    def reflected(self, mirror: Ints, d: Floats) -> tuple[Floats, ReflectedRays]:
        """Directions (3, N) of mirrors' cells in the base's frame, and their reflections."""
        on_base = rotated(self.on_base[:, :, mirror], d)
        return on_base, reflect(self.measured.mirrors, self.ball[mirror], on_base)


def ray_transfer(measured: MeasuredPrototype) -> RayTransfer:
    """The transfer for all mirrors of the camera."""
    context = measured.context
    ball, base = context.ball, context.base_rotation(context.angle)
    merged = Rotation.identity(ball.size)
    if context.moved:
        apex = base.apply(context.prototype.balls.columns("px", 3)[:, ball].T).T
        merged = _picture_rotation(context, apex)
    return RayTransfer(measured, _matrices(merged), _matrices(base.inv() * merged), ball, base)


def _picture_rotation(context: PrototypeContext, ball_apex: Floats) -> Rotation:
    """Rotations of the pictures that are moved along with their balls, of apices (3, m), mm.

    About the axis, by the known difference of the azimuths of ball and mirror; and in the plane of
    the axis, by the known angle between both apices as the pinhole sees them.
    """
    _, zero, third = frame = context.frame
    mirror_apex = context.export.mirrors.columns("px", 3)[:, context.mirror_rows]
    apices, pinhole = (mirror_apex, ball_apex), context.pinhole[:, None]
    (_, phi), (_, psi) = (polar_and_azimuth(frame, x) for x in apices)
    (low, _), (high, _) = (polar_and_azimuth(frame, x - pinhole) for x in apices)
    # At right angles to the plane of axis and ball: rotates the axis toward the ball's azimuth.
    across = -np.sin(psi)[:, None] * zero + np.cos(psi)[:, None] * third
    tilt = Rotation.from_rotvec((high - low)[:, None] * across)
    return tilt * context.base_rotation(psi - phi)


def _matrices(rotations: Rotation) -> Floats:
    """(3, 3, m) matrices of m rotations."""
    return np.ascontiguousarray(np.moveaxis(rotations.as_matrix(), 0, 2))


def rotated(matrix: Floats, d: Floats) -> Floats:
    """(3, N) columns d under matrices (3, 3, N)."""
    return np.asarray(np.einsum("ijn,jn->in", matrix, d))


def nearest_points(transfer: Reflecting, mirror: Ints, d: Floats) -> Floats:
    """(3, m, s) where reflected rays are nearest to the origin; NaN beside the ball.

    Of unit directions d (3, m, s) in the cells of mirrors (m,).
    """
    nearest = np.empty_like(d)
    for part in chunks(mirror.size, max(1, RAYS_A_CHUNK // d.shape[2])):
        repeated = np.repeat(mirror[part], d.shape[2])
        rays = transfer.reflected(repeated, d[:, part].reshape(3, -1))[1]
        nearest[:, part] = nearest_on_rays(rays).reshape(3, -1, d.shape[2])
    return nearest


def blocked_rays(transfer: RayTransfer, mirror: Ints, d: Floats) -> tuple[Bools, tuple[str, ...]]:
    """Which rays do not get from the pinhole by their ball to the capture sphere, and why.

    Of directions d (3, N) in the shell's picture, in the cells of mirrors (N,).
    """

    def blocked(part: slice) -> tuple[Bools, set[str]]:
        hits = [*_hits(transfer, mirror[part], d[:, part])]
        stopped = np.any([hit for hit, _ in hits], axis=0)
        return stopped, {name for hit, name in hits if hit.any()}

    results = in_threads(blocked, list(chunks(mirror.size, RAYS_A_CHUNK)))
    names = sorted({name for _, blockers in results for name in blockers})
    return np.concatenate([blocked for blocked, _ in results]), tuple(names)


def _hits(transfer: RayTransfer, mirror: Ints, d: Floats) -> Hits:
    """All that can stop rays, one after the other, on the way to the ball and from it."""
    measured = transfer.measured
    radius, base = measured.context.radius, transfer.base[mirror]
    ball = transfer.ball[mirror]
    to_ball, rays = transfer.reflected(mirror, d)
    pinhole = np.broadcast_to(measured.context.pinhole[:, None], to_ball.shape)
    off_centre = norm(rays.point - measured.body[:, ball])
    yield ~(off_centre <= measured.body_radius[ball] + LIFT_MM), "nothing (beside the ball)"
    from_object = distances_to_segments(np.zeros_like(to_ball), pinhole, rays.point)
    yield from_object < radius, "the capture sphere"
    nearest, from_ball = nearest_on_rays(rays), unit(rays.toward)
    depth = np.sqrt(np.maximum((radius + GRAZE_MM) ** 2 - norm(nearest) ** 2, 0))
    start = rays.point + LIFT_MM * from_ball
    legs = (
        (pinhole, unit(to_ball), norm(rays.point - pinhole) - SKIN_MM),
        (start, from_ball, norm(nearest - start) - depth),
    )
    for origin, along, length in legs:
        for k in range(measured.body_radius.size):
            hit = _meets(measured.body[:, k], measured.body_radius[k], origin, along, length)
            yield hit & (ball != k), f"ball {k + 1}"
        yield from _part_hits(measured.rotating, origin, along, length)
        on_ground = [base.apply(np.array(x.T)).T for x in (origin, along)]
        yield from _part_hits(measured.fixed, on_ground[0], on_ground[1], length)


def _meets(centre: Floats, radius: float, origin: Floats, along: Floats, length: Floats) -> Bools:
    """(N,) whether rays of unit directions meet a sphere within a length."""
    offset = origin - centre[:, None]
    b = dot(offset, along)
    rest = dot(offset, offset) - b * b
    first = -b - np.sqrt(np.maximum(radius**2 - rest, 0))
    return np.asarray((rest < radius**2) & (first < length) & (b < 0))


def _part_hits(obstacles: BodyScene, origin: Floats, along: Floats, length: Floats) -> Hits:
    """Rays that meet parts within a length, part by part."""
    body, distance = obstacles.first(origin, along)
    near = distance < length
    for k in np.unique(body[near]).tolist():
        yield near & (body == k), obstacles.names[k]
