"""What holds each ball in its seat: the magnet, and the pocket behind the pads that it is in."""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.holding import MIN_RATIO, Motion, force_needed, glue_force, pull_on_ball
from tbcad.prototype.drive.balance import ball_masses
from tbcad.types import Bools, Floats

PAD_AZIMUTHS = np.radians(np.arange(0, 120, 5))  # tried for the first pad
WEB_MM = 0.8  # between pocket and pads


def pad_normals(tilt: float, azimuth: Floats) -> Floats:
    """Unit normals toward the ball's centre of the pads of k seats, (k, 3, 3).

    Args:
        tilt: angle to the seat's axis, which is z and away from the ball's pads, radians.
        azimuth: of each seat's first pad about the axis, radians, (k,).
    """
    around = azimuth[:, None] + np.arange(3) * 2 * np.pi / 3
    along = np.full((*around.shape, 1), np.cos(tilt))
    return -np.concatenate([np.sin(tilt) * unit_circle(around), along], axis=-1)


@dataclass(frozen=True)
class Pockets:
    """Pockets behind k balls."""

    magnet: Floats  # diameter of the magnet, zero: glue, mm, (k,)
    height: Floats  # of the magnet, zero: glue, mm, (k,)
    radius: Floats  # of the pocket, or of the well, mm, (k,)


def glue_wells(prototype: PrototypeLayout, needed: Floats, room: Floats) -> Pockets:
    """Wells for glue behind all balls.

    Args:
        prototype: with its balls.
        needed: force that each ball needs, N, (k,).
        room: radius between the pads, mm, (k,).

    Raises:
        SpecError: when glue does not hold a ball.
    """
    radius = room / 2
    if (weak := glue_force(radius) < MIN_RATIO * needed).any():
        ball = first_ball(weak)
        raise SpecError(
            f"glue holds ball {ball} of {prototype.balls.size[ball - 1]} by "
            f"{glue_force(radius)[ball - 1]:.2f} N, {MIN_RATIO:g} times {needed[ball - 1]:.2f} N "
            "are needed: make prototype.base.pad_mm smaller"
        )
    return Pockets(np.zeros_like(radius), np.zeros_like(radius), radius)


def magnet_pockets(
    spec: BaseSpec, prototype: PrototypeLayout, needed: Floats, room: Floats
) -> Pockets:
    """The largest magnets that fit, of the strong height only where the other would not hold.

    Args:
        spec: of the base.
        prototype: with its balls.
        needed: force that each ball needs, N, (k,).
        room: radius between the pads, mm, (k,).

    Raises:
        SpecError: when no magnet fits, or none that fits holds a ball.
    """
    diameter = _largest(spec, room)
    height = np.full_like(diameter, spec.magnet_height_mm)
    weak = _pull(spec, prototype, diameter, height) < MIN_RATIO * needed
    weak &= ~prototype.balls.cap  # a cap has a magnet too, and no weight
    height[weak] = max(spec.magnet_height_mm, spec.strong_magnet_height_mm)
    pull = _pull(spec, prototype, diameter, height)
    weak &= pull < MIN_RATIO * needed
    if weak.any():
        ball = first_ball(weak)
        raise SpecError(
            f"ball {ball} of {prototype.balls.size[ball - 1]} needs {MIN_RATIO:g} times "
            f"{needed[ball - 1]:.2f} N, its magnet of {diameter[ball - 1]:g} mm pulls "
            f"{pull[ball - 1]:.2f} N: add larger ones to prototype.base.magnets_mm, make "
            "prototype.base.strong_magnet_height_mm larger, prototype.base.magnet_gap_mm smaller, "
            "or set prototype.base.hold to glue"
        )
    return Pockets(diameter, height, (diameter + spec.magnet_play_mm) / 2)


def worst_force_needed(
    prototype: PrototypeLayout, axes: Floats, tilt: float, motion: Motion
) -> Floats:
    """Force that each ball needs with its pads at their worst azimuth, N, (k,)."""
    masses = ball_masses(prototype, motion.cap_density)
    turned = [np.full(len(masses), one) for one in PAD_AZIMUTHS.tolist()]
    normals = np.stack([pad_normals(tilt, azimuth) @ axes for azimuth in turned])
    frame = prototype.array.ellipsoid.frame()
    needed = force_needed(normals, axes[:, 2], masses.centre, masses.mass_g, frame, motion)
    return np.asarray(needed.max(axis=0))


def first_ball(flags: Bools) -> int:
    """Number of the first ball whose flag is set, from 1."""
    return int(flags.argmax()) + 1


def _largest(spec: BaseSpec, room: Floats) -> Floats:
    """Diameter of the largest magnet in each room, mm, (k,)."""
    sizes = np.array(sorted(spec.magnets_mm))
    fitting = (sizes + spec.magnet_play_mm) / 2 <= room[:, None]
    if (none := np.logical_not(fitting.any(axis=1))).any():
        ball = first_ball(none)
        largest = float(2 * room[ball - 1] - spec.magnet_play_mm)
        raise SpecError(
            f"no magnet fits between the pads of ball {ball}: add one of {max(largest, 0):.1f} mm "
            "or less to prototype.base.magnets_mm, or set prototype.base.hold to glue"
        )
    return np.asarray(np.where(fitting, sizes, 0).max(axis=1))


def _pull(spec: BaseSpec, prototype: PrototypeLayout, diameter: Floats, height: Floats) -> Floats:
    """Pull on each ball, N, (k,); of a cap as if it were a ball."""
    gap, radius = spec.magnet_gap_mm, prototype.balls.body_radius
    sizes = np.column_stack([radius, diameter / 2, height]).tolist()
    return np.array([pull_on_ball(ball, gap, magnet, tall) for ball, magnet, tall in sizes])
