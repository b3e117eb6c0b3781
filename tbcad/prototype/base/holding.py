"""The force that keeps a ball on its three pads, whatever the angle of the base.

Pads push and do not pull. A magnet or glue must hold so strongly along the seat's axis that each of
the three pads bears some load in every direction of gravity, with the base's acceleration, without
friction: a ball that only stays in its cup would already have left a pad.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import dot, norm
from tbcad.prototype.drive.balance import GRAVITY
from tbcad.spec.design import Spec
from tbcad.types import Floats

MIN_RATIO = 2.0  # of the force there is over the force needed
WIDER_GAP_MM = 0.5  # by which a printed gap may be wider than drawn
# Of glue: a quarter of what the weakest glue bears on many plastics in a test, silicone with
# 1.4 N/mm^2 (The Loctite Design Guide for Bonding Plastics).
GLUE_MPA = 0.35


@dataclass(frozen=True)
class Motion:
    """How the base moves, and what caps weigh.

    Attributes:
        speed: radians/s.
        acceleration: radians/s^2.
        cap_density: g/cm^3.
    """

    speed: float
    acceleration: float
    cap_density: float


AT_DEFAULT_SPEED = Motion(np.radians(15.0), np.radians(50.0), 1.27)
"""The motion of the defaults."""


def base_motion(spec: Spec) -> Motion:
    """The motion that a design asks for."""
    motion = spec.prototype.motion
    speed, acceleration = np.radians([motion.feed_deg_min / 60, motion.acceleration_deg_s2])
    return Motion(float(speed), float(acceleration), spec.printer.density_g_cm3)


def force_needed(
    normals: Floats, axis: Floats, centre: Floats, mass_g: Floats, frame: Floats, motion: Motion
) -> Floats:
    """Least force along the seats' axes with which all pads always bear load, N, (..., k).

    With pads' reactions N, n^T N + F a + f = 0 for a force F along the axis a and a load f. Pad i
    bears load where F is above v_i . f, v_i being row i of the inverse of -n^T over its product
    with a. Over a full turn of the base, gravity across its axis points everywhere.

    Args:
        normals: of the pads toward the balls, unit, (..., k, 3, 3).
        axis: of the seats, away from the balls' pads, unit, (k, 3).
        centre: of the balls, mm, (k, 3).
        mass_g: of the balls, (k,).
        frame: rows: axis of the base and two across it, (3, 3).
        motion: of the base.
    """
    inverse: Floats = np.linalg.inv(np.swapaxes(normals, -1, -2)).astype(np.float64)
    share = -inverse / dot(inverse, axis[:, None])[..., None]
    along, *_ = frame
    lean = float(norm(frame[1:, 2]))
    radial = (centre - (centre @ along)[:, None] * along) * 1e-3
    outward = motion.speed**2 * dot(share, radial[:, None])
    tangential = motion.acceleration * np.abs(dot(share, np.cross(along, radial)[:, None]))
    gravity = GRAVITY * (lean * norm(share @ frame[1:].T) - float(frame[0, 2]) * (share @ along))
    return np.asarray(mass_g * 1e-3 * (gravity + outward + tangential).max(axis=-1))


def glue_force(radius: Floats) -> Floats:
    """Force of glued round faces of radii (...) in mm, N, (...)."""
    return np.asarray(GLUE_MPA * np.pi * radius**2)
