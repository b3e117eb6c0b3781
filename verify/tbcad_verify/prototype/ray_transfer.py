"""Rays of the shell's picture taken to the balls: turned as the picture is, and reflected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.rays import RAYS_A_CHUNK
from tbcad_verify.mesh.surfaces import ReflectedRays, reflect
from tbcad_verify.mesh.vectors import chunks, dot
from tbcad_verify.prototype import axis
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype, to_base, to_ground
from tbcad_verify.types import Floats, Ints


@dataclass(frozen=True)
class RayTransfer:
    """The measured prototype, and what leads from directions of the shell's picture to rays on it.

    Attributes:
        measured: balls and obstacles.
        moved: (3, 3, m) for each mirror, from its cell in the shell's picture to where the merged
            picture has it on its ball.
        on_base: (3, 3, m) the same, in the frame of the base at the mirror's stop.
        ball: (m,) that stands in.
        angle: (m,) of the base, rad.
    """

    measured: MeasuredPrototype
    moved: Floats
    on_base: Floats
    ball: Ints
    angle: Floats

    def lines(self, mirror: Ints, d: Floats) -> tuple[Floats, ReflectedRays]:
        """Directions (3, N) of mirrors' cells in the base's frame, and reflected on the balls."""
        way = rotated(self.on_base[:, :, mirror], d)
        return way, reflect(self.measured.seen, self.ball[mirror], way)


def ray_transfer(measured: MeasuredPrototype) -> RayTransfer:
    """Get ready for rays of all mirrors of the camera."""
    context = measured.context
    ball, angle = context.ball, context.angle
    basis = [np.repeat(one[:, None], ball.size, axis=1) for one in np.eye(3)]
    moved = [_moved(context, ball, angle, one) for one in basis]
    on_base = [to_base(context, one, angle) for one in moved]
    return RayTransfer(measured, np.stack(moved, axis=1), np.stack(on_base, axis=1), ball, angle)


def _moved(context: PrototypeContext, ball: Ints, angle: Floats, d: Floats) -> Floats:
    """Directions (3, m) of all mirrors' cells where the merged picture has them.

    A picture that is moved goes along with its ball: about the axis by the known difference of
    their azimuths, and in the plane of the axis by the known angle between both apices, as the
    pinhole sees them. One that is fixed stays.
    """
    if not context.prototype.moved:
        return d
    own = context.export.mirrors.columns("px", 3)[:, context.mine]
    its = to_ground(context, context.prototype.balls.columns("px", 3)[:, ball], angle)
    (_, phi), (_, psi) = (axis.angles(context.frame, x) for x in (own, its))
    (low, _), (high, _) = (
        axis.angles(context.frame, x - context.pinhole[:, None]) for x in (own, its)
    )
    turned = axis.turned(d, context.frame[0][:, None], psi - phi)
    # Across the plane of the axis and the ball: turns the axis toward the ball's azimuth.
    _, zero, third = context.frame
    side = zero[:, None] * -np.sin(psi) + third[:, None] * np.cos(psi)
    return axis.turned(turned, side, high - low)


def rotated(matrix: Floats, d: Floats) -> Floats:
    """(3, N) columns d under matrices (3, 3, N)."""
    return np.asarray(np.einsum("ijn,jn->in", matrix, d))


def nearest_points(transfer: RayTransfer, mirror: Ints, d: Floats) -> Floats:
    """(3, m, s) where reflected rays are nearest to the origin; NaN beside the ball.

    Args:
        transfer: ready for rays.
        mirror: (m,) whose cells the directions are in.
        d: (3, m, s) unit.
    """
    found = np.empty_like(d)
    for part in chunks(mirror.size, max(1, RAYS_A_CHUNK // d.shape[2])):
        own = np.repeat(mirror[part], d.shape[2])
        at = nearest_to_origin(transfer.lines(own, d[:, part].reshape(3, -1))[1])
        found[:, part] = at.reshape(3, -1, d.shape[2])
    return found


def nearest_to_origin(lines: ReflectedRays) -> Floats:
    """(3, N) the point of each reflected ray that is nearest to the origin; not before it starts.

    A small ball turns rays at its rim so far that they go away from the object.
    """
    p, r = lines.point, lines.toward
    return np.asarray(p + np.maximum(-dot(p, r) / dot(r, r), 0) * r)


def lengths(x: Floats) -> Floats:
    """(m, s) lengths of (3, m, s)."""
    return np.asarray(np.sqrt((x**2).sum(axis=0)))
