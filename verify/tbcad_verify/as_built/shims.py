"""What to put under each ball, or to take away, for it to be where the base should have it.

What moves all balls alike (the angle that counts as zero, the axis, the place of the base) is no
fault of a seat: the motion of the whole base that fits best is taken off first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad_verify.as_built.machine import AsBuilt
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.types import Floats

LEAST_BALLS = 3  # whose places tell a motion of the base from errors of seats


@dataclass(frozen=True)
class SeatErrors:
    """K seats, and the base as a whole.

    Attributes:
        off: (3, K) from where the base should have the centres to where they are, mm, in the frame
            of the designed base.
        shim: (3, K) thickness to put on each pad, mm; negative: to take away.
        placed: (3, K) where centres are once this is done, mm, with the base at angle zero.
        turn: of the whole base about its axis, radians, by which zero is off.
        tilt: of the whole base beside that, radians.
        shift: of the whole base, mm.
    """

    off: Floats
    shim: Floats
    placed: Floats
    turn: float
    tilt: float
    shift: float


def seat_errors(context: PrototypeContext, machine: AsBuilt) -> SeatErrors:
    """Compare the balls with the record, and solve the shims of all pads.

    A ball that lies on three planes moves by d where each plane is raised by n.d along its normal.
    """
    designed, found = context.prototype.balls.columns("cx", 3), machine.centre
    turn, shift = _motion(designed, found)
    placed = turn.apply(designed.T).T + shift[:, None]
    off = turn.inv().apply((found - placed).T).T
    normals = np.array([seat.normals for seat in context.prototype.seats])
    shim = -np.einsum("kpi,ik->pk", normals, off)
    about = float(turn.as_rotvec() @ context.frame[0])
    aside = float(np.linalg.norm(turn.as_rotvec() - about * context.frame[0]))
    return SeatErrors(off, shim, placed, about, aside, float(np.linalg.norm(shift)))


def _motion(designed: Floats, found: Floats) -> tuple[Rotation, Floats]:
    """The rigid motion that takes designed points (3, K) nearest to the found ones."""
    if designed.shape[1] < LEAST_BALLS:
        return Rotation.identity(), np.zeros(3)
    middles = designed.mean(axis=1), found.mean(axis=1)
    before, after = designed - middles[0][:, None], found - middles[1][:, None]
    turn, _ = Rotation.align_vectors(after.T, before.T)
    return turn, middles[1] - turn.apply(middles[0])
