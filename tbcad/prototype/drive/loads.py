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
RATED_RISE_K = (
    80.0  # most, with rated current in both phases, on makers' sheets of NEMA 17 steppers
)
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
    """A drive under the torques of the base."""

    drive: Drive
    torques: BaseTorques

    @property
    def teeth_in_mesh(self) -> float:
        """Of the pinion; zero without a belt."""
        drive = self.drive
        if not (drive.pinion and drive.wheel):
            return 0.0
        smaller = pitch_diameter(drive.wheel) - pitch_diameter(drive.pinion)
        wrap = math.pi - 2 * math.asin(smaller / 2 / drive.centre_mm)
        return drive.pinion["teeth"] * wrap / (2 * math.pi)

    @property
    def belt_pull(self) -> float:
        """Greatest pull, N; zero without a belt."""
        return self.drive.belt_pull(self.torques.peak)

    @property
    def belt_rating(self) -> float:
        """Pull that the belt bears for years, N; zero without a belt."""
        if not self.drive.belt:
            return 0.0
        lost = LOST_PER_TOOTH * max(MIN_MESH - math.floor(self.teeth_in_mesh), 0)
        return self.drive.belt["rating_n"] * max(1 - lost, 0.0)

    @property
    def belt_tension(self) -> float:
        """Tension of both sides at rest with which the slack side stays tight, N."""
        return (0.5 + SLACK_SHARE) * self.belt_pull

    @property
    def motor_radial(self) -> float:
        """Force of both sides of the belt on the motor's shaft under the greatest pull, N."""
        drive = self.drive
        if not (drive.pinion and drive.wheel):
            return 0.0
        cosine = drive.span_mm / drive.centre_mm
        # Both sides lean by the same angle from the line between the axes.
        return math.hypot(2 * self.belt_tension * cosine, self.belt_pull * math.sqrt(1 - cosine**2))

    @property
    def motor_radial_limit(self) -> float:
        """Force on the shaft under which the motor's bearings last long enough, N; 0 of a stage."""
        return float(self.drive.rated_radial * (RATED_LIFE_H / MIN_LIFE_H) ** (1 / LIFE_EXPONENT))

    @property
    def belt_tone(self) -> float:
        """Frequency of a plucked side with that tension, Hz; zero without a belt."""
        drive = self.drive
        if not drive.belt:
            return 0.0
        length = drive.belt["teeth"] * drive.belt["pitch_mm"]
        density = drive.belt.mass_g / length  # g/mm are kg/m
        return math.sqrt(self.belt_tension / density) / (2 * drive.span_mm * 1e-3)

    @property
    def self_locking(self) -> bool:
        """Whether the base stays without a current."""
        return self.drive.efficiency < SELF_LOCKING

    @property
    def hold_share(self) -> float:
        """Share of the rated current with which the motor holds the base at rest."""
        if self.self_locking:
            return 0.0
        return min(HOLD_MARGIN * self.torques.gravity / self.drive.holds_nmm, 1.0)

    @property
    def hold_current(self) -> float:
        """Root mean square of a phase's current, A."""
        return self.hold_share * self.drive.rated_current

    @property
    def hold_loss(self) -> float:
        """Heat of both phases at rest, W."""
        return 2 * self.hold_current**2 * self.drive.resistance

    @property
    def motor_rise(self) -> float:
        """Rise of the motor's temperature at rest, K: as its losses, 80 K with rated current."""
        return RATED_RISE_K * self.hold_share**2

    @property
    def motor_wind_up(self) -> float:
        """Deviation of the motor at the base, under gravity with the holding current, radians."""
        return float(self._motor_wind_up_at(np.array(self.torques.gravity)))

    def _motor_wind_up_at(self, torque: Floats) -> Floats:
        share = 1.0 if self.self_locking else self.hold_share
        return self.drive.wind_up_angle(torque / share if share else 0 * torque)

    @property
    def belt_wind_up(self) -> float:
        """Turn of the base by the belt's stretch under gravity, both sides tight, radians."""
        return self.torques.gravity * self._belt_compliance

    @property
    def _belt_compliance(self) -> float:
        """Turn of the base for each N mm on it, both sides tight."""
        drive = self.drive
        if not (drive.belt and drive.wheel):
            return 0.0
        stiffness = 2 * drive.belt["stiffness_n"] / drive.span_mm
        return drive.belt_pull(1.0) / stiffness / (pitch_diameter(drive.wheel) / 2)

    def wind_up_at(self, torque: Floats) -> Floats:
        """Angles by which the base yields to torques (N mm) about its axis at rest, radians."""
        return self._motor_wind_up_at(torque) + torque * self._belt_compliance

    @property
    def wind_up(self) -> float:
        """Of motor and belt together, radians."""
        return self.motor_wind_up + self.belt_wind_up

    def faults(self) -> Iterator[str]:
        """What the drive does not bear, in words."""
        yields = math.degrees(self.wind_up)
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


def choose_drive(name: str, torques: BaseTorques, drives: Sequence[Drive]) -> Drive:
    """The first drive of a name that bears the base; SpecError when none does."""
    candidates = [drive for drive in drives if drive.name == name]
    if not candidates:
        known = ", ".join(dict.fromkeys(drive.name for drive in drives))
        raise SpecError(f"no drive {short_text(name)} in drives.csv: use one of {known}")
    faults = {drive: list(DriveLoads(drive, torques).faults()) for drive in candidates}
    for drive, found in faults.items():
        if not found:
            return drive
    nearest = min(candidates, key=lambda drive: (len(faults[drive]), -drive.holds_nmm))
    raise SpecError(
        f"no drive {name} bears {torques.peak:.0f} N mm on the base; the nearest, with "
        f"{nearest.motor.name}, {', '.join(faults[nearest])}: make prototype.largest_ball_mm or "
        "prototype.motion.safety smaller, or use another prototype.base.drive"
    )
