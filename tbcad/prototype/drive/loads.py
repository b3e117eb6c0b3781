"""What a drive bears: belt, shaft, holding current and heat, wind-up, each with its limit."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.core.spec.errors import SpecError, short_text
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.drive.drive import Drive, pitch_diameter
from tbcad.types import Floats

MIN_MESH = 6  # teeth of a wheel in mesh that bear a belt's rating (SDP/SI, Technical Section, 13.3)
LOST_PER_TOOTH = 0.2  # of the rating, for each tooth less
SLACK_SHARE = 0.2  # of the pull, left in the slack side; 0.1 to 0.3 (Autodesk Inventor, belts)
# Holding torque over gravity while the base rests: friction helps there, and nothing accelerates.
HOLD_MARGIN = 1.4
SELF_LOCKING = 0.5  # efficiency below which a worm holds without a current
# Most, with rated current in both phases, on makers' sheets of NEMA 17 steppers.
RATED_RISE_K = 80.0
MOUNT_LIMIT_C = 65.0  # at which printed PETG yields: heat deflection at 65 to 75 C
ROOM_C = 25.0
MAX_RISE_K = MOUNT_LIMIT_C - ROOM_C
MAX_WIND_UP_DEG = 1.0  # of motor and belt together
# Hours of turning that a motor's bearings last under the radial load of motors.csv (Beckhoff
# AS1010), and how many are enough: a capture turns the motor for some four minutes.
RATED_LIFE_H, MIN_LIFE_H = 30_000.0, 500.0
LIFE_EXPONENT = 3  # of a ball bearing's load (ISO 281)


@dataclass(frozen=True)
class BaseTorques:
    """Torques on the base, N mm."""

    gravity: float  # the largest over the stops and between them
    peak: float  # with acceleration
    required: float  # the peak times the safety factor


def base_torques(
    balance: BaseBalance, swing: tuple[float, float], motion: MotionSpec
) -> BaseTorques:
    """Torques of a base between two base angles (radians)."""
    acceleration = math.radians(motion.acceleration_deg_s2)
    return BaseTorques(
        balance.max_torque(*swing),
        balance.required_torque(*swing, acceleration, 1.0),
        balance.required_torque(*swing, acceleration, motion.safety),
    )


@dataclass(frozen=True)
class DriveLoads:
    """A drive under the torques of the base; what concerns a belt is zero without one."""

    drive: Drive
    torques: BaseTorques
    teeth_in_mesh: float  # of the pinion
    belt_pull: float  # greatest pull, N
    belt_rating: float  # pull that the belt bears for years, N
    belt_tension: float  # of both sides at rest with which the slack side stays tight, N
    belt_tone: float  # frequency of a plucked side with that tension, Hz
    belt_compliance: float  # turn of the base for each N mm on it, both sides tight, radians
    motor_radial: float  # force of both sides on the motor's shaft under the greatest pull, N
    motor_radial_limit: float  # under which the motor's bearings last long enough, N; 0 of a stage
    self_locking: bool  # whether the base stays without a current
    hold_share: float  # of the rated current with which the motor holds the base at rest

    @property
    def hold_current(self) -> float:
        """Root mean square of a phase's current at rest, A."""
        return self.hold_share * self.drive.rated_current

    @property
    def hold_loss(self) -> float:
        """Heat of both phases at rest, W."""
        return 2 * self.hold_current**2 * self.drive.resistance

    @property
    def motor_rise(self) -> float:
        """Rise of the motor's temperature at rest, K: as its losses, 80 K with rated current."""
        return RATED_RISE_K * self.hold_share**2

    def _motor_wind_up_at(self, torque: Floats) -> Floats:
        share = 1.0 if self.self_locking else self.hold_share
        return self.drive.wind_up_angle(torque / share if share else 0 * torque)

    def wind_up_at(self, torque: Floats) -> Floats:
        """Angles by which the base yields to torques (N mm) about its axis at rest, radians."""
        return self._motor_wind_up_at(torque) + torque * self.belt_compliance

    @property
    def motor_wind_up(self) -> float:
        """Deviation of the motor at the base, under gravity with the holding current, radians."""
        return float(self._motor_wind_up_at(np.array(self.torques.gravity)))

    @property
    def belt_wind_up(self) -> float:
        """Turn of the base by the belt's stretch under gravity, both sides tight, radians."""
        return self.torques.gravity * self.belt_compliance

    def faults(self) -> Iterator[str]:
        """What the drive does not bear, in words."""
        yields = math.degrees(self.motor_wind_up + self.belt_wind_up)
        if self.drive.holds_nmm < self.torques.required:
            yield f"holds {self.drive.holds_nmm:.0f} N mm of {self.torques.required:.0f}"
        if self.belt_pull > self.belt_rating:
            yield f"has a belt for {self.belt_rating:.0f} N of {self.belt_pull:.0f}"
        if self.motor_radial > self.motor_radial_limit:
            yield (
                f"loads its motor's shaft with {self.motor_radial:.0f} N, at most "
                f"{self.motor_radial_limit:.0f} are allowed"
            )
        if self.motor_rise > MAX_RISE_K:
            yield f"gets warmer by {self.motor_rise:.0f} K, at most {MAX_RISE_K:.0f} are allowed"
        if yields > MAX_WIND_UP_DEG:
            yield f"yields by {yields:.2f} deg, at most {MAX_WIND_UP_DEG:g} are allowed"


def drive_loads(drive: Drive, torques: BaseTorques) -> DriveLoads:
    """What a drive bears under the torques of the base."""
    pull = drive.belt_pull(torques.peak)
    tension, self_locking = (0.5 + SLACK_SHARE) * pull, drive.efficiency < SELF_LOCKING
    held = 0.0 if self_locking else min(HOLD_MARGIN * torques.gravity / drive.holds_nmm, 1.0)
    teeth = rating = tone = compliance = radial = 0.0
    if drive.belt and drive.pinion and drive.wheel:
        centre, span, wheel = drive.centre_mm, drive.span_mm, pitch_diameter(drive.wheel)
        wrap = math.pi - 2 * math.asin((wheel - pitch_diameter(drive.pinion)) / 2 / centre)
        teeth = drive.pinion["teeth"] * wrap / (2 * math.pi)
        lost = LOST_PER_TOOTH * max(MIN_MESH - math.floor(teeth), 0)
        rating = drive.belt["rating_n"] * max(1 - lost, 0.0)
        # Both sides lean by the same angle from the line between the axes.
        cosine = span / centre
        radial = math.hypot(2 * tension * cosine, pull * math.sqrt(1 - cosine**2))
        density = drive.belt.mass_g / (drive.belt["teeth"] * drive.belt["pitch_mm"])  # kg/m
        tone = math.sqrt(tension / density) / (2 * span * 1e-3)
        stiffness = 2 * drive.belt["stiffness_n"] / span
        compliance = drive.belt_pull(1.0) / stiffness / (wheel / 2)
    return DriveLoads(
        drive=drive,
        torques=torques,
        teeth_in_mesh=teeth,
        belt_pull=pull,
        belt_rating=rating,
        belt_tension=tension,
        belt_tone=tone,
        belt_compliance=compliance,
        motor_radial=radial,
        motor_radial_limit=drive.rated_radial * (RATED_LIFE_H / MIN_LIFE_H) ** (1 / LIFE_EXPONENT),
        self_locking=self_locking,
        hold_share=held,
    )


def choose_drive(name: str, torques: BaseTorques, drives: Sequence[Drive]) -> Drive:
    """The first drive of a name that bears the base; SpecError when none does."""
    candidates = [drive for drive in drives if drive.name == name]
    if not candidates:
        known = ", ".join(dict.fromkeys(drive.name for drive in drives))
        raise SpecError(f"no drive {short_text(name)} in drives.csv: use one of {known}")
    faults = {drive: list(drive_loads(drive, torques).faults()) for drive in candidates}
    for drive, found in faults.items():
        if not found:
            return drive
    nearest = min(candidates, key=lambda drive: (len(faults[drive]), -drive.holds_nmm))
    raise SpecError(
        f"no drive {name} bears {torques.peak:.0f} N mm on the base; the nearest, with "
        f"{nearest.motor.name}, {', '.join(faults[nearest])}: make prototype.largest_ball_mm or "
        "prototype.motion.safety smaller, or use another prototype.base.drive"
    )
