"""The drives of the base: motor, gear and belt; the torque that each holds, and what it bears.

What is borne, by belt, shaft and motor, has its limit; of several drives the first within all is
chosen.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources.abc import Traversable

import numpy as np
from scipy.optimize import brentq

from tbcad.core.spec.csv_rows import Row, positive_number, read_rows
from tbcad.core.spec.errors import SpecError, short_text
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, package_lists
from tbcad.types import Floats

DRIVE_COLUMNS = ("drive", "motor", "pinion", "wheel", "belt", "coupling", "efficiency", "source")
KINDS = {  # of the parts that each of these columns may name
    "motor": ("motors", "stages"),
    "pinion": ("wheels",),
    "wheel": ("wheels",),
    "belt": ("belts",),
    "coupling": ("couplings",),
}
MAX_EFFICIENCY = 1.0
STEPS_PER_PERIOD = 4  # full steps in a period of a stepper's torque


@dataclass(frozen=True)
class Drive:
    """A motor and the parts between it and the base; a stage contains its motor and its gear."""

    name: str  # kind of drive that the hub of the base has holes for
    motor: PurchasedPart  # stepper, or stage
    pinion: PurchasedPart | None  # on the motor; None without a belt
    wheel: PurchasedPart | None  # on the base
    belt: PurchasedPart | None  # between the two
    coupling: PurchasedPart | None  # on the motor's shaft; None unless direct
    efficiency: float  # of the gear
    brake: PurchasedPart | None = None  # on the rear of the motor's shaft

    @property
    def parts(self) -> tuple[PurchasedPart, ...]:
        """All parts, one of each."""
        parts = (self.motor, self.pinion, self.wheel, self.belt, self.coupling, self.brake)
        return tuple(part for part in parts if part)

    @property
    def ratio(self) -> float:
        """Turns of the motor for one of the base."""
        if self.pinion and self.wheel:
            return self.wheel["teeth"] / self.pinion["teeth"]
        return self.motor["ratio"] if self.motor.kind == "stages" else 1.0

    @property
    def holds_nmm(self) -> float:
        """Torque on the base that the motor's holding torque makes, N mm."""
        return self.motor["holding_nmm"] * self.ratio * self.efficiency

    @property
    def motor_length_mm(self) -> float:
        """Length of the motor with its brake behind the plate, mm."""
        return self.motor["length_mm"] + (self.brake["length_mm"] if self.brake else 0.0)

    def of_motor(self, size: str) -> float:
        """A size in motors.csv, as rated_a of a phase; zero of a stage, whose motor is its own."""
        return self.motor[size] if self.motor.kind == "motors" else 0.0

    def steps_per_deg(self, microsteps: int) -> float:
        """Microsteps for a degree of the base."""
        return self.motor["full_steps"] * microsteps * self.ratio / 360

    def wind_up_angle(self, torque: Floats) -> Floats:
        """Angles by which the base yields to torques (N mm), with their signs, radians.

        A stepper's torque is a sine of its rotor's deviation with a period of four full steps, so
        it holds a torque only at a deviation.
        """
        share = np.clip(torque / (self.motor["holding_nmm"] * self.ratio), -1.0, 1.0)
        periods = self.motor["full_steps"] / STEPS_PER_PERIOD
        return np.asarray(np.arcsin(share) / periods / self.ratio)

    def belt_pull(self, torque: float) -> float:
        """Pull in the belt under a torque on the base (N mm), N; zero without a belt."""
        return abs(torque) / (pitch_diameter(self.wheel) / 2) if self.wheel else 0.0

    @property
    def centre_mm(self) -> float:
        """Distance of the motor's axis from the base's with the belt tight; zero without one."""
        if not (self.pinion and self.wheel and self.belt):
            return 0.0
        length = self.belt["teeth"] * self.belt["pitch_mm"]
        return centre_distance(length, pitch_diameter(self.pinion), pitch_diameter(self.wheel))

    @property
    def span_mm(self) -> float:
        """Length of a straight side of the belt; zero without one."""
        if not (self.pinion and self.wheel):
            return 0.0
        smaller = (pitch_diameter(self.wheel) - pitch_diameter(self.pinion)) / 2
        return math.sqrt(self.centre_mm**2 - smaller**2)


def pitch_diameter(wheel: PurchasedPart) -> float:
    """Pitch diameter of a toothed wheel, mm."""
    return wheel["teeth"] * wheel["pitch_mm"] / math.pi


def belt_length(distance: float, small: float, large: float) -> float:
    """Length of an open belt round two wheels, mm, from centre distance and diameters, mm."""
    lean = math.asin((large - small) / 2 / distance)
    straight = 2 * distance * math.cos(lean)
    return straight + (large + small) * math.pi / 2 + (large - small) * lean


def centre_distance(length: float, small: float, large: float) -> float:
    """Distance of two wheels' axes at which a belt of a length (mm) is tight, mm.

    SpecError when the belt is too short for the wheels to clear each other.
    """
    touching = (small + large) / 2
    if length <= belt_length(touching, small, large):
        raise SpecError(
            f"a belt of {length:g} mm is too short for wheels of {small:.1f} and {large:.1f} mm: "
            "use a longer one in drives.csv"
        )
    return float(brentq(lambda d: belt_length(d, small, large) - length, touching, length))


def load_drives(parts: Parts, folder: Traversable | None = None) -> tuple[Drive, ...]:
    """All drives in the order of drives.csv, the smallest of a name first.

    SpecError when the file is wrong, or names a part that is in no list.
    """
    file = (folder or package_lists()) / "drives.csv"
    rows = read_rows(file, "drives.csv", DRIVE_COLUMNS)
    return tuple(_drive(where, row, parts) for where, row in rows)


def _drive(where: str, row: Row, parts: Parts) -> Drive:
    motor, pinion, wheel, belt, coupling = (
        _named_part(where, row, column, parts) for column in KINDS
    )
    if motor is None:
        raise SpecError(f"{where}, column motor: empty: name a part of motors.csv or stages.csv")
    if len({part is None for part in (pinion, wheel, belt)}) > 1:
        raise SpecError(f"{where}: pinion, wheel and belt go together: name all or none")
    efficiency = positive_number(where, row, "efficiency", MAX_EFFICIENCY)
    return Drive(row["drive"], motor, pinion, wheel, belt, coupling, efficiency)


def _named_part(where: str, row: Row, column: str, parts: Parts) -> PurchasedPart | None:
    if not row[column]:
        return None
    part = parts.get(row[column])
    if part is None or part.kind not in KINDS[column]:
        lists = " or ".join(f"{kind}.csv" for kind in KINDS[column])
        raise SpecError(
            f"{where}, column {column}: {short_text(row[column])} is not in {lists}: add it"
        )
    return part


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
    required: float  # the peak times the safety factor, which covers friction too


def base_torques(
    balance: BaseBalance, swing: tuple[float, float], motion: MotionSpec
) -> BaseTorques:
    """Torques of a base between two base angles (radians)."""
    gravity = balance.max_torque(*swing)
    peak = gravity + balance.inertia * math.radians(motion.acceleration_deg_s2) * 1e-6
    return BaseTorques(gravity, peak, motion.safety * peak)


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
        return self.hold_share * self.drive.of_motor("rated_a")

    @property
    def hold_loss(self) -> float:
        """Heat of both phases at rest, W."""
        return 2 * self.hold_current**2 * self.drive.of_motor("resistance_ohm")

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
        """Loads beyond the drive's limits, in words."""
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
    """Loads of a drive under the torques of the base."""
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
    lasting = (RATED_LIFE_H / MIN_LIFE_H) ** (1 / LIFE_EXPONENT)
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
        motor_radial_limit=drive.of_motor("radial_n") * lasting,
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
