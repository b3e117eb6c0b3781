"""Base angles that the program drives to: stops, start, and where homing ends.

Homing turns the base downward until its tab presses the switch, then up again by the pull-off. The
controller then knows the angle, and keeps the base between soft limits. Base angles are positive
by the right-hand rule about the axis from the origin to the camera: counterclockwise as the camera
sees the base.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.types import Floats

# Of the switch below the lowest angle of the program, so that its lever is free there.
SWITCH_BELOW_DEG = 8.0
MIN_BELOW_DEG = 3.0
PULL_OFF_DEG = 2.0
OVERTRAVEL_DEG = 2.0  # below the switch, before the base stops
ANGLE_STEP_DEG = 0.1  # that the switch's angle is rounded up to
ABOVE_DEG = 1.0  # of the upper soft limit above the highest angle


@dataclass(frozen=True)
class StopSequence:
    """The stops of the base in one run; there are two runs, one for each turn of the object."""

    start: float  # base angle below all stops, degrees
    angle: Floats  # of the stops, degrees, ascending, (s,)
    mirrors: NDArray[np.int64]  # shown at each stop, (s,)


@dataclass(frozen=True)
class HomeAngles:
    """Base angles of homing, degrees."""

    switch: float  # at which the switch trips
    homed: float  # after the pull-off, without the trim
    travel: float  # from the switch to the upper soft limit and the pull-off beyond it


def stop_sequence(prototype: PrototypeLayout, motion: MotionSpec) -> StopSequence:
    """The stops, and a start below them so that play in the drive is taken up before the first.

    Raises:
        SpecError: when the base cannot be where the program starts, for post or camera.
    """
    low, high = free_base_angles(prototype)
    home = math.radians(motion.home_deg)
    if not low <= home <= high:
        raise SpecError(
            f"prototype.motion.home_deg is {motion.home_deg:g}, but the base is free from "
            f"{math.degrees(low):.1f} to {math.degrees(high):.1f} degrees: choose one of these"
        )
    angle = np.degrees(prototype.stops.angle)
    start = max(float(angle[0]) - motion.approach_deg, min(math.degrees(low), float(angle[0])))
    return StopSequence(start, angle, np.bincount(prototype.stops.stop, minlength=len(angle)))


def free_base_angles(prototype: PrototypeLayout) -> tuple[float, float]:
    """Base angles between which no ball meets post or camera, within the largest swing, radians."""
    problem, azimuth = prototype.problem, prototype.placement.azimuth
    low = max(float((problem.min_azimuth - azimuth).max()), -problem.max_swing / 2)
    return low, min(float((problem.max_azimuth - azimuth).min()), problem.max_swing / 2)


def home_angles(prototype: PrototypeLayout, motion: MotionSpec) -> HomeAngles:
    """Where the switch trips: below all that the program drives to, where the base is still free.

    Raises:
        SpecError: when there is no room for it below the first stop.
    """
    sequence = stop_sequence(prototype, motion)
    lowest = min(sequence.start, motion.home_deg)
    highest = max(float(sequence.angle[-1]), motion.home_deg)
    free = math.degrees(free_base_angles(prototype)[0])
    wanted = max(lowest - SWITCH_BELOW_DEG, free + OVERTRAVEL_DEG)
    switch = math.ceil(wanted / ANGLE_STEP_DEG) * ANGLE_STEP_DEG
    if motion.controller == "grblhal" and switch > lowest - MIN_BELOW_DEG:
        raise SpecError(
            f"the base is free from {free:.1f} degrees on, which leaves no room for a switch below "
            f"its first angle {lowest:.1f}: make prototype.max_swing_deg larger, "
            "prototype.motion.approach_deg smaller, or set prototype.motion.controller to grbl"
        )
    return HomeAngles(switch, switch + PULL_OFF_DEG, highest + ABOVE_DEG - switch + PULL_OFF_DEG)
