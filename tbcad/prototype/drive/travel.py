"""Base angles that the program drives to: stops, start, and where homing ends.

Homing turns the base downward until its tab presses the switch, then up again by the pull-off. The
controller then knows the angle, and keeps the base between soft limits. Base angles are positive
by the right-hand rule about the axis from the origin to the camera: counterclockwise as the camera
sees the base.

The base has no counterweight and a stepper without current holds next to nothing. Without power the
base falls to where its centre of gravity is lowest, or strikes an end of its travel.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.hub import PIN_MM, PIN_OUT_MM, ZERO_DISC_MM
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.records.prototype_drive import PowerOff
from tbcad.types import Floats

# Of the switch below the lowest angle of the program, so that its lever is free there.
SWITCH_BELOW_DEG = 8.0
MIN_BELOW_DEG = 3.0
PULL_OFF_DEG = 2.0
OVERTRAVEL_DEG = 2.0  # below the switch, before the base stops
ANGLE_STEP_DEG = 0.1  # that the switch's angle is rounded up to
ABOVE_DEG = 1.0  # of the upper soft limit above the highest angle
# Permitted of a printed hole round a pin, as below the heads of screws; of a rod of hardened steel
# in shear: 0.4 of a proof stress of 580 MPa (8.8), which such a rod exceeds.
PRESSURE_LIMIT_MPA, SHEAR_LIMIT_MPA = 20.0, 230.0
MJ_PER_J, KG_M2 = 1e3, 1e-9  # KG_M2: of a gram millimetre squared


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

    SpecError when the base cannot be where the program starts, for post or camera.
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

    SpecError when there is no room for it below the first stop.
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


def power_off(balance: BaseBalance, low: float, high: float, *, holds_itself: bool) -> PowerOff:
    """What a base does without power between the ends of its travel, radians."""
    energy = 0.0 if holds_itself else _fall(balance, low, high) / MJ_PER_J
    inertia = balance.inertia * KG_M2
    speed = math.degrees(math.sqrt(2 * energy / inertia)) if inertia else 0.0
    force = balance.torque_amplitude / PIN_OUT_MM
    return PowerOff(
        fall_energy_j=energy,
        fall_speed_deg_s=speed,
        pin_force_n=force,
        pin_shear_mpa=force / (math.pi / 4 * PIN_MM**2),
        pin_shear_limit_mpa=SHEAR_LIMIT_MPA,
        pin_pressure_mpa=force / (PIN_MM * ZERO_DISC_MM),
        pin_pressure_limit_mpa=PRESSURE_LIMIT_MPA,
    )


def _fall(balance: BaseBalance, low: float, high: float) -> float:
    """Largest energy of gravity on the way to an end of the travel, N mm."""
    ends: list[float] = balance.energy(np.array([low, high])).tolist()
    top = balance.angle_of_top
    top += 2 * math.pi * math.ceil((low - top) / (2 * math.pi))
    highest = balance.torque_amplitude if top <= high else max(ends)
    return highest - min(ends)
