"""The tables of a prototype: balls, rotation plan, stops, parts list, holes of the plate."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tbcad_verify.record.columns import Columns, Counts, column, numbers, numbers_or_empty
from tbcad_verify.record.validation import Name
from tbcad_verify.types import Bools, Floats

MOST = 1000  # balls, parts or LEDs
MOST_ROWS = 400_000
LARGEST = 1e9

Numbers = Annotated[Floats, numbers(-LARGEST, LARGEST)]
Lengths = Annotated[Floats, numbers(1e-3, 1e4)]
Angles = Annotated[Floats, numbers(-360, 360)]
Masses = Annotated[Floats, numbers_or_empty(0, LARGEST)]
Names = Annotated[NDArray[np.str_], column(Name, np.str_)]
Kinds = Annotated[NDArray[np.str_], column(Literal["ball", "cap"], np.str_)]


class Balls(Columns):
    """One ball or cap a row, K of them, with the base at angle zero."""

    most_rows: ClassVar[int] = MOST

    number: Counts
    kind: Kinds
    diameter_mm: Lengths
    mass_g: Masses
    radius_mm: Lengths
    body_radius_mm: Lengths
    polar_deg: Numbers
    azimuth_deg: Numbers
    px: Numbers
    py: Numbers
    pz: Numbers
    nx: Numbers
    ny: Numbers
    nz: Numbers
    cx: Numbers
    cy: Numbers
    cz: Numbers
    bx: Numbers
    by: Numbers
    bz: Numbers
    coverage_mm: Numbers
    coverage_fixed_mm: Numbers

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if (wrong := np.flatnonzero(self.number != np.arange(1, len(self) + 1))).size:
            raise ValueError(f"ball {wrong[0] + 1} must have number {wrong[0] + 1}")
        return self

    @property
    def cap(self) -> Bools:
        """(K,) true for caps."""
        return np.asarray(self.kind == "cap")

    def names(self, which: NDArray[np.integer]) -> list[str]:
        """What reports call them."""
        return [f"ball {k + 1}" for k in which.tolist()]


class PlateHoles(Columns):
    """plate_holes.csv: one tapped hole of the base plate a row."""

    most_rows: ClassVar[int] = MOST

    x_mm: Numbers
    y_mm: Numbers


class Plan(Columns):
    """One mirror's picture a row, N of them; angles in degrees, numbers from 1."""

    most_rows: ClassVar[int] = MOST_ROWS

    order: Counts
    turn: Angles = Field(alias="object_turn_deg")
    stop: Counts
    angle: Angles = Field(alias="base_angle_deg")
    ball: Counts
    mirror: Names


class Stops(Columns):
    """One stop of the base a row, S of them; angles in degrees, numbers from 1."""

    most_rows: ClassVar[int] = MOST_ROWS

    stop: Counts
    angle: Angles = Field(alias="base_angle_deg")
