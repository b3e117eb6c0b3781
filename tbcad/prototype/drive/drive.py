"""The drive of the base: purchased parts from CSV files, and which of them hold a torque."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable

from scipy.optimize import brentq

from tbcad.prototype.balls.catalogue import Row, check_number, table_rows
from tbcad.spec.errors import SpecError, shown

COMMON = ("part", "what", "material", "mass_g")
# What each kind of part is described by, all above zero; hole patterns are a square's side or a
# circle's diameter.
SIZES: dict[str, tuple[str, ...]] = {
    "motors": (
        *("frame_mm", "length_mm", "shaft_mm", "pilot_mm", "pilot_height_mm"),
        *("hole_square_mm", "thread_mm", "holding_nmm", "full_steps"),
    ),
    "stages": ("top_mm", "hole_circle_mm", "hole_mm", "ratio", "holding_nmm", "full_steps"),
    "wheels": ("teeth", "pitch_mm", "width_mm", "bore_mm"),
    "belts": ("teeth", "pitch_mm", "width_mm"),
    "couplings": ("bore_mm", "flange_mm", "hole_circle_mm", "hole_mm"),
    "shafts": ("diameter_mm", "length_mm"),
    "bearings": ("bore_mm", "outer_mm", "width_mm", "load_n"),
    "screws": ("thread_mm", "length_mm", "head_mm", "head_height_mm"),
    "setscrews": ("thread_mm", "length_mm"),
    "inserts": ("thread_mm", "length_mm", "outer_mm", "hole_mm"),
    "dowels": ("diameter_mm", "length_mm"),
    "magnets": ("diameter_mm", "height_mm"),
    "leds": ("diameter_mm", "flange_mm", "height_mm"),
    "electronics": (),
    "extrusions": ("side_mm", "slot_mm", "length_mm"),
    "tnuts": ("thread_mm", "slot_mm"),
    "collars": ("bore_mm", "outer_mm", "width_mm"),
    "plates": ("length_mm", "width_mm", "thickness_mm"),
}
DRIVE_COLUMNS = ("drive", "motor", "pinion", "wheel", "belt", "coupling", "efficiency", "source")
NEEDED = {  # which of motor, pinion, wheel, belt and coupling a drive may have, by kind
    "motor": ("motors", "stages"),
    "pinion": ("wheels",),
    "wheel": ("wheels",),
    "belt": ("belts",),
    "coupling": ("couplings",),
}
_LARGEST = 1e6


@dataclass(frozen=True)
class PurchasedPart:
    """A purchased part.

    Attributes:
        kind: its list, a key of SIZES.
        name: unique in all lists.
        what: description with standard.
        material: of it.
        mass_g: grams.
        sizes: numbers in the order of SIZES, units in their names.
        source: where they come from.
    """

    kind: str
    name: str
    what: str
    material: str
    mass_g: float
    sizes: tuple[float, ...]
    source: str

    def __getitem__(self, size: str) -> float:
        """One of the sizes, by its name in SIZES."""
        return self.sizes[SIZES[self.kind].index(size)]


Parts = dict[str, PurchasedPart]


@dataclass(frozen=True)
class Drive:
    """A motor and what is between it and the base; a stage has its motor and its gear in it.

    Attributes:
        name: kind of drive, as the base's hub has holes for.
        motor: or stage.
        pinion: on the motor; None without a belt.
        wheel: on the base.
        belt: between the two.
        coupling: on the motor's shaft; None unless direct.
        efficiency: of the gear.
    """

    name: str
    motor: PurchasedPart
    pinion: PurchasedPart | None
    wheel: PurchasedPart | None
    belt: PurchasedPart | None
    coupling: PurchasedPart | None
    efficiency: float

    @property
    def parts(self) -> tuple[PurchasedPart, ...]:
        """All parts, one of each."""
        found = (self.motor, self.pinion, self.wheel, self.belt, self.coupling)
        return tuple(part for part in found if part)

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

    def steps_per_deg(self, microsteps: int) -> float:
        """Microsteps for a degree of the base."""
        return self.motor["full_steps"] * microsteps * self.ratio / 360

    def sag(self, torque: float) -> float:
        """Angle by which the base gives way under a torque (N mm), radians.

        A stepper's torque is a sine of the angle by which its rotor is away, four full steps a
        period, so it holds nothing without giving way.
        """
        share = min(abs(torque) / (self.motor["holding_nmm"] * self.ratio), 1.0)
        return math.asin(share) * 4 / self.motor["full_steps"] / self.ratio

    def belt_pull(self, torque: float) -> float:
        """Pull in the belt when the base bears a torque (N mm), N; zero without a belt."""
        return abs(torque) / (pitch_diameter(self.wheel) / 2) if self.wheel else 0.0

    @property
    def centre_mm(self) -> float:
        """Distance of the motor's axis from the base's with the belt tight; zero without one."""
        if not (self.pinion and self.wheel and self.belt):
            return 0.0
        length = self.belt["teeth"] * self.belt["pitch_mm"]
        return centre_distance(length, pitch_diameter(self.pinion), pitch_diameter(self.wheel))


def pitch_diameter(wheel: PurchasedPart) -> float:
    """Pitch diameter of a toothed wheel, mm."""
    return wheel["teeth"] * wheel["pitch_mm"] / math.pi


def belt_length(distance: float, small: float, large: float) -> float:
    """Length of an open belt about two wheels, mm, from centre distance and diameters, mm."""
    lean = math.asin((large - small) / 2 / distance)
    straight = 2 * distance * math.cos(lean)
    return straight + (large + small) * math.pi / 2 + (large - small) * lean


def centre_distance(length: float, small: float, large: float) -> float:
    """Distance of two wheels' axes that makes a belt (mm) tight, mm.

    Raises:
        SpecError: when the belt is too short for the wheels to clear each other.
    """
    least = (small + large) / 2
    if length <= belt_length(least, small, large):
        raise SpecError(
            f"a belt of {length:g} mm is too short for wheels of {small:.1f} and {large:.1f} mm: "
            "use a longer one in drives.csv"
        )
    return float(brentq(lambda c: belt_length(c, small, large) - length, least, length))


def load_parts(folder: Traversable | None = None) -> Parts:
    """All purchased parts by name.

    Args:
        folder: that holds a CSV file for each kind; without, tbcad's own.

    Raises:
        SpecError: when a file is wrong; it names line and column.
    """
    parts: Parts = {}
    for kind, sizes in SIZES.items():
        for where, row in _read(f"{kind}.csv", folder, (*COMMON, *sizes, "source")):
            part = _part(where, kind, row)
            if part.name in parts:
                raise SpecError(f"{where}, column part: {shown(part.name)} twice: remove one")
            parts[part.name] = part
    return parts


def _part(where: str, kind: str, row: Row) -> PurchasedPart:
    for column in ("part", "what", "material", "source"):
        if not row[column]:
            raise SpecError(f"{where}, column {column}: empty: fill it in")
    mass, *sizes = (_number(where, row, key) for key in ("mass_g", *SIZES[kind]))
    return PurchasedPart(
        kind, row["part"], row["what"], row["material"], mass, tuple(sizes), row["source"]
    )


def load_drives(parts: Parts, folder: Traversable | None = None) -> tuple[Drive, ...]:
    """All drives in the order of drives.csv, the smallest of a name first.

    Raises:
        SpecError: when the file is wrong, or names a part that is in no list.
    """
    rows = _read("drives.csv", folder, DRIVE_COLUMNS)
    return tuple(_drive(where, row, parts) for where, row in rows)


def _drive(where: str, row: Row, parts: Parts) -> Drive:
    found = {column: _named(where, row, column, parts) for column in NEEDED}
    motor, pinion, wheel, belt = (found[key] for key in ("motor", "pinion", "wheel", "belt"))
    if motor is None:
        raise SpecError(f"{where}, column motor: empty: name a part of motors.csv or stages.csv")
    if len({part is None for part in (pinion, wheel, belt)}) > 1:
        raise SpecError(f"{where}: pinion, wheel and belt go together: name all or none")
    efficiency = _number(where, row, "efficiency", 1)
    return Drive(row["drive"], motor, pinion, wheel, belt, found["coupling"], efficiency)


def _named(where: str, row: Row, column: str, parts: Parts) -> PurchasedPart | None:
    if not row[column]:
        return None
    part = parts.get(row[column])
    if part is None or part.kind not in NEEDED[column]:
        lists = " or ".join(f"{kind}.csv" for kind in NEEDED[column])
        raise SpecError(f"{where}, column {column}: {shown(row[column])} is not in {lists}: add it")
    return part


def choose_drive(name: str, needed: float, drives: Sequence[Drive]) -> Drive:
    """The first drive of a name that holds a torque on the base (N mm).

    Raises:
        SpecError: when none does; it says what to change.
    """
    named = [drive for drive in drives if drive.name == name]
    if not named:
        known = ", ".join(dict.fromkeys(drive.name for drive in drives))
        raise SpecError(f"no drive {shown(name)} in drives.csv: use one of {known}")
    for drive in named:
        if drive.holds_nmm >= needed:
            return drive
    most = max(drive.holds_nmm for drive in named)
    raise SpecError(
        f"no drive {name} holds {needed:.0f} N mm on the base, at most {most:.0f}: balance the "
        "base with a counterweight, make prototype.largest_ball_mm or prototype.motion.safety "
        "smaller, or use another prototype.base.drive"
    )


def _number(where: str, row: Row, column: str, most: float = _LARGEST) -> float:
    check_number(where, column, row[column], most)
    return float(row[column])


def _read(
    name: str, folder: Traversable | None, columns: Sequence[str]
) -> Iterator[tuple[str, Row]]:
    place = files("tbcad.prototype.purchased") if folder is None else folder
    try:
        text = (place / name).read_text(encoding="utf-8")
    except (OSError, ValueError):
        raise SpecError(f"{name}: cannot be read as UTF-8 text: check the file") from None
    yield from table_rows(name, text, columns)
