"""The drives of the base: motor, gear and belt, and the torque that each holds."""

import math
from dataclasses import dataclass
from importlib.resources.abc import Traversable

import numpy as np
from scipy.optimize import brentq

from tbcad.core.spec.csv_rows import Row, positive_number, read_rows
from tbcad.core.spec.errors import SpecError, short_text
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

    @property
    def parts(self) -> tuple[PurchasedPart, ...]:
        """All parts, one of each."""
        parts = (self.motor, self.pinion, self.wheel, self.belt, self.coupling)
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
    def rated_current(self) -> float:
        """Of the motor's phases, A; zero of a stage."""
        return self.motor["rated_a"] if self.motor.kind == "motors" else 0.0

    @property
    def resistance(self) -> float:
        """Of a phase of the motor, ohm; zero of a stage."""
        return self.motor["resistance_ohm"] if self.motor.kind == "motors" else 0.0

    @property
    def rated_radial(self) -> float:
        """Radial load that the motor's shaft bears at its end, N; zero of a stage."""
        return self.motor["radial_n"] if self.motor.kind == "motors" else 0.0

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
