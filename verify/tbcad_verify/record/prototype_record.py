"""What the record of a prototype holds, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.record.prototype_tables import Plan, Stops
from tbcad_verify.types import Floats

RECORD = "prototype.json"
BALLS, PLAN, STOPS, PROGRAM = "balls.csv", "rotation_plan.csv", "stops.csv", "rotation_plan.nc"
ROLES = ("base", "cap", "stage", "frame", "tool")
NUMBERS = (
    *("diameter_mm", "radius_mm", "body_radius_mm", "polar_deg", "azimuth_deg"),
    *("px", "py", "pz", "nx", "ny", "nz", "cx", "cy", "cz", "bx", "by", "bz"),
    *("mirrors", "pixels", "pixels_shell", "coverage_mm", "coverage_fixed_mm", "error_deg"),
)
BALL_COLUMNS = (
    *("number", "kind", "size", "diameter_mm", "grade", "standard", "mass_g"),
    *NUMBERS[1:],
)


@dataclass(frozen=True)
class Balls:
    """One ball or cap a row, K of them, with the base at angle zero.

    Attributes:
        cap: (K,) true for caps.
        table: (K, 23), the columns `NUMBERS`.
        rows: as in the record, key by key.
    """

    cap: NDArray[np.bool_]
    table: Floats
    rows: tuple[Mapping[str, Any], ...]

    def __len__(self) -> int:
        """How many."""
        return len(self.cap)

    def columns(self, first: str, count: int = 1) -> Floats:
        """Consecutive columns, shape (count, K)."""
        start = NUMBERS.index(first)
        return np.ascontiguousarray(self.table[:, start : start + count].T)

    def of(self, key: str) -> Floats:
        """(K,) one column."""
        return np.asarray(self.columns(key)[0])

    def names(self, which: NDArray[np.integer]) -> list[str]:
        """What reports call them."""
        return [f"ball {k + 1}" for k in which.tolist()]


@dataclass(frozen=True)
class Seats:
    """One seat a ball, K of them, as recorded: where to begin looking for pads.

    Attributes:
        axis: (K, 3) unit, away from the light.
        normals: (K, 3, 3) unit, of each pad, toward the ball's centre.
        contacts: (K, 3, 3) mm, the pads' middles.
        pad: (K,) diameter of the pads, mm.
    """

    axis: Floats
    normals: Floats
    contacts: Floats
    pad: Floats


@dataclass(frozen=True)
class Printed:
    """One part to be printed; y = x @ axes + origin lays it on the bed.

    Attributes:
        name: of the part.
        role: one of `ROLES`.
        ball: of a cap, its ball from 0; else -1.
        quantity: how many are made.
        stl: the mesh, on the bed.
        step: the solid, in its place; empty: none.
        threemf: the mesh again; empty: none.
        axes: (3, 3).
        origin: (3,) mm.
    """

    name: str
    role: str
    ball: int
    quantity: int
    stl: str
    step: str
    threemf: str
    axes: Floats
    origin: Floats


@dataclass(frozen=True)
class Led:
    """A light-emitting diode of the stage: its position (3,) mm and direction (3,)."""

    name: str
    position: Floats
    direction: Floats


@dataclass(frozen=True)
class Bought:
    """A purchased part, whose shape only the assembly has; `turns`: whether with the base."""

    name: str
    turns: bool


@dataclass(frozen=True)
class Prototype:
    """The whole record.

    Attributes:
        camera: id of the camera that it serves.
        target_mm: coverage wanted.
        moved: whether pictures are moved along with their balls when they are merged.
        frame: (3, 3) rows axis, azimuth zero, third.
        swing: least and greatest base angle driven, degrees.
        pad_um: by which pads may misplace a ball.
        balls: K of them.
        seats: K of them.
        parts: printed.
        leds: of the stage.
        bought: what is neither printed nor a ball.
        plan: every picture.
        stops: of the base.
        program: text of the controller's program.
        ball_rows: fields of balls.csv.
        assembly: STEP and GLB of the whole; empty: none.
        digests: file name -> (size, sha256), of what was parsed.
    """

    camera: str
    target_mm: float
    moved: bool
    frame: Floats
    swing: tuple[float, float]
    pad_um: float
    balls: Balls
    seats: Seats
    parts: tuple[Printed, ...]
    leds: tuple[Led, ...]
    bought: tuple[Bought, ...]
    plan: Plan
    stops: Stops
    program: str
    ball_rows: list[list[str]]
    assembly: tuple[str, str]
    digests: Mapping[str, tuple[int, str]]

    @property
    def part_files(self) -> frozenset[str]:
        """All files of all parts and of the assembly."""
        files = ((part.stl, part.step, part.threemf) for part in self.parts)
        return frozenset(name for names in (*files, self.assembly) for name in names if name)
