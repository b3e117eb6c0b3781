"""How each ball and cap is held, in numbers: the force needed, and the force that there is."""

from dataclasses import dataclass

import numpy as np

from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.cap_solids import cap_pocket, cap_spigot
from tbcad.prototype.base.holding import (
    WIDER_GAP_MM,
    Motion,
    force_needed,
    glue_force,
    pull_of_pair,
    pull_on_ball,
)
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.balance import ball_masses
from tbcad.types import Bools, Floats


@dataclass(frozen=True)
class HeldBalls:
    """Forces along the seats' axes of k balls.

    Attributes:
        needed: least force with which all three pads bear load at every base angle, N, (k,).
        available: pull of the magnet, or what glue bears, N, (k,).
        wider: the same with a gap that is wider by WIDER_GAP_MM, N, (k,).
        glued: whether glue holds it, (k,).
    """

    needed: Floats
    available: Floats
    wider: Floats
    glued: Bools


def held_balls(base: BaseLayout, prototype: PrototypeLayout, motion: Motion) -> HeldBalls:
    """What holds the balls in their seats, with the pads as they are turned."""
    seats, masses = base.seats, ball_masses(prototype, motion.cap_density)
    needed = force_needed(
        seats.pad_normals, seats.axis, seats.centre, masses.mass_g, base.frame, motion
    )
    forces = np.array([_forces(base, prototype, k) for k in range(len(seats))])
    glued = np.isnan(forces[:, 1])
    return HeldBalls(needed, forces[:, 0], np.where(glued, forces[:, 0], forces[:, 1]), glued)


def _forces(base: BaseLayout, prototype: PrototypeLayout, k: int) -> tuple[float, float]:
    """Force with the gap as drawn and with a wider one, N; not a number with glue."""
    seats, gap = base.seats, base.spec.magnet_gap_mm
    magnet, height = float(seats.magnet[k]) / 2, float(seats.magnet_height[k])
    if prototype.balls.cap[k] and magnet:
        own, own_height = cap_pocket(base, k, float(prototype.balls.body_depth[k]))
        own -= base.spec.magnet_play_mm / 2
        between = float(seats.radius[k]) + gap - cap_spigot(base, k)[1]
        if own > 0:
            pulls = [
                pull_of_pair(own, magnet, between + wider, (own_height, height))
                for wider in (0.0, WIDER_GAP_MM)
            ]
            return pulls[0], pulls[1]
    elif magnet:
        radius = float(seats.radius[k])
        pulls = [pull_on_ball(radius, gap + w, magnet, height) for w in (0.0, WIDER_GAP_MM)]
        return pulls[0], pulls[1]
    return float(glue_force(seats.pocket[k])), float("nan")
