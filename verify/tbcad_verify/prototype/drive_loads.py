"""What belt and motor bear, worked out again, and the limits of both."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad_verify.record.prototype_sections import DriveRecord
from tbcad_verify.types import Floats

SHARE = 1e-6  # of figures that follow from others
TINY = 1e-9
FULL_STEPS = 200.0
STEPS_PER_PERIOD = 4.0  # full steps in a period of a stepper's torque
RATING_N_MM = 111.0 / 25.4  # of GT2 belts, for each mm of width
STIFFNESS_N_MM = 98.07 / 0.01 / 6.0  # least: 10 kg stretch 6 mm of width by 1 %
BELT_G_MM2 = 1.1 * 1.25e-3  # a belt's mass for each mm of length and width
FULL_MESH, LOST_PER_TOOTH = 6, 0.2
SLACK_SHARE = 0.2
PITCH_MM = 2.0  # of GT2 belts, which have a whole number of teeth
LENGTH_MM = 0.1  # of a belt round its wheels
PHASES = {"NEMA17-40": (2.0, 1.1), "NEMA17-48": (2.0, 1.4), "NEMA17-60": (2.1, 1.6)}  # A, ohm
HOLD_MARGIN = 1.4
SELF_LOCKING = 0.5  # efficiency below which a worm holds
RATED_RISE_K, MAX_RISE_K = 80.0, 40.0
MAX_WIND_UP_DEG = 1.0
RADIAL_N, RATED_LIFE_H, MIN_LIFE_H = 22.0, 30_000.0, 500.0  # of a motor's shaft and its bearings
FIGURE_SHARE = 2e-4  # the lists round what they have


@dataclass(frozen=True)
class Gear:
    """Turns of the motor for one of the base, and the belt if there is one.

    Attributes:
        ratio: of the turns.
        wheel: pitch radius, mm.
        pinion: pitch radius, mm.
        distance: of their axes, mm.
        teeth: of the pinion.
        width: of the belt, mm.
    """

    ratio: float
    wheel: float = 0.0
    pinion: float = 0.0
    distance: float = 0.0
    teeth: int = 0
    width: float = 0.0


def shaft_load(drive: DriveRecord, gear: Gear) -> float:
    """Force of both sides of the belt on the motor's shaft, N: law of cosines."""
    if not gear.width:
        return 0.0
    lean = np.arcsin((gear.wheel - gear.pinion) / gear.distance)
    pull = drive.peak_torque_nmm / gear.wheel
    tight, slack = (SLACK_SHARE + 1) * pull, SLACK_SHARE * pull
    return float(np.sqrt(tight**2 + slack**2 + 2 * tight * slack * np.cos(2 * lean)))


def shaft_limit(drive: DriveRecord) -> float:
    """Force with which a motor's bearings last long enough, N: ISO 281."""
    rated = RADIAL_N if drive.motor in PHASES else 0.0
    return float(rated * np.cbrt(RATED_LIFE_H / MIN_LIFE_H))


def wind_ups(drive: DriveRecord, torque: Floats, ratio: float) -> Floats:
    """Turn of the base, degrees, under torques (N mm).

    Args:
        drive: the record, whose largest turn is known to be right.
        torque: of gravity.
        ratio: turns of the motor for one of the base.
    """
    worst = drive.worst_torque_nmm
    if not worst:
        return np.zeros_like(torque)
    electrical = FULL_STEPS / STEPS_PER_PERIOD * ratio  # periods of the torque in a turn
    sine = np.sin(np.radians(drive.motor_wind_up_deg * electrical))
    motor = np.degrees(np.arcsin(torque / worst * sine)) / electrical
    return np.asarray(motor + drive.belt_wind_up_deg * torque / worst)


def belt_faults(drive: DriveRecord, gear: Gear) -> Iterator[str]:
    """Pull, rating, tension and stretch of the belt."""
    names = ("belt_pull_n", "belt_rating_n", "belt_tension_n", "belt_tone_hz")
    if not gear.width:
        for name in (*names, "teeth_in_mesh", "belt_wind_up_deg"):
            yield from unlike(name, getattr(drive, name), 0.0)
        return
    lean = float(np.arcsin((gear.wheel - gear.pinion) / gear.distance))
    span = gear.distance * np.cos(lean)
    mesh = gear.teeth * (np.pi - 2 * lean) / (2 * np.pi)
    round_it = 2 * span + gear.wheel * (np.pi + 2 * lean) + gear.pinion * (np.pi - 2 * lean)
    if abs(round_it - PITCH_MM * round(round_it / PITCH_MM)) > LENGTH_MM:
        yield f"no belt has the {round_it:.1f} mm that its wheels want"
    pull = drive.peak_torque_nmm / gear.wheel
    rating = RATING_N_MM * gear.width * (1 - LOST_PER_TOOTH * max(FULL_MESH - int(mesh), 0))
    tension = (0.5 + SLACK_SHARE) * pull
    tone = np.sqrt(tension / (BELT_G_MM2 * gear.width)) / (2e-3 * span)
    stretch = drive.worst_torque_nmm / gear.wheel * span / (2 * STIFFNESS_N_MM * gear.width)
    yield from unlike("teeth_in_mesh", drive.teeth_in_mesh, mesh)
    for name, mine in zip(names, (pull, rating, tension, float(tone)), strict=True):
        yield from unlike(name, getattr(drive, name), mine, FIGURE_SHARE)
    turned = float(np.degrees(stretch / gear.wheel))
    yield from unlike("belt_wind_up_deg", drive.belt_wind_up_deg, turned, FIGURE_SHARE)
    if pull > rating:
        yield f"the belt is pulled by {pull:.1f} N and rated for {rating:.1f} N"


def motor_faults(
    drive: DriveRecord, motor_torque: float, efficiency: float, ratio: float
) -> Iterator[str]:
    """Holding current, heat and deviation of the motor.

    Args:
        drive: the record.
        motor_torque: of the motor, at the base, N mm.
        efficiency: of the gear.
        ratio: turns of the motor for one of the base.
    """
    locks = efficiency < SELF_LOCKING
    margin = 0.0 if locks else HOLD_MARGIN
    share = min(margin * drive.worst_torque_nmm / (motor_torque * efficiency), 1.0)
    rated, resistance = PHASES.get(drive.motor, (0.0, 0.0))
    loss, rise = 2 * resistance * (share * rated) ** 2, RATED_RISE_K * share**2
    held = motor_torque * (1.0 if locks else share)
    sine = min(drive.worst_torque_nmm / held, 1.0) if held else 0.0
    angle = float(np.degrees(np.arcsin(sine)) * STEPS_PER_PERIOD / FULL_STEPS / ratio)
    for name, mine in (
        ("hold_current_a", share * rated),
        ("hold_loss_w", loss),
        ("motor_rise_k", rise),
        ("motor_wind_up_deg", angle),
    ):
        yield from unlike(name, getattr(drive, name), mine)
    if rise > MAX_RISE_K:
        yield f"the motor gets {rise:.0f} K warmer, its printed mount bears {MAX_RISE_K:.0f} K"
    wind_up = angle + drive.belt_wind_up_deg
    if wind_up > MAX_WIND_UP_DEG:
        yield f"motor and belt yield by {wind_up:.2f} deg, at most {MAX_WIND_UP_DEG:g} are allowed"


def unlike(name: str, recorded: float, expected: float, share: float = SHARE) -> Iterator[str]:
    """A fault where a recorded figure is another."""
    if not abs(recorded - expected) <= share * abs(expected) + TINY:
        yield f"{name} is {recorded:g}, not {expected:g}"
