"""Rays of the shell's picture on the balls: rotated as the picture is, and reflected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad_verify.mesh.rays import RAYS_A_CHUNK
from tbcad_verify.mesh.surfaces import ReflectedRays, nearest_on_rays, reflect
from tbcad_verify.mesh.vectors import chunks, polar_and_azimuth
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype
from tbcad_verify.types import Floats, Ints


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
    if context.prototype.moved:
        merged = _picture_rotation(
            context, base.apply(context.prototype.balls.columns("px", 3)[:, ball].T).T
        )
    return RayTransfer(measured, _matrices(merged), _matrices(base.inv() * merged), ball, base)


def _picture_rotation(context: PrototypeContext, ball_apex: Floats) -> Rotation:
    """Rotations of the pictures that are moved along with their balls.

    About the axis, by the known difference of the azimuths of ball and mirror; and in the plane of
    the axis, by the known angle between both apices as the pinhole sees them.

    Args:
        context: the record.
        ball_apex: (3, m) mm, of each mirror's ball at its stop.
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

    Args:
        transfer: to the balls.
        mirror: (m,) whose cells the directions are in.
        d: (3, m, s) unit.
    """
    nearest = np.empty_like(d)
    for part in chunks(mirror.size, max(1, RAYS_A_CHUNK // d.shape[2])):
        repeated = np.repeat(mirror[part], d.shape[2])
        rays = transfer.reflected(repeated, d[:, part].reshape(3, -1))[1]
        nearest[:, part] = nearest_on_rays(rays).reshape(3, -1, d.shape[2])
    return nearest
