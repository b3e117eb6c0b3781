"""Untrusted CSV files, validated column by column and read into arrays; mirrors.csv among them."""

from __future__ import annotations

import csv
import io
from functools import cached_property
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, FailFast, Field, ValidationError

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.record.files import AGAIN, FileBytes
from tbcad_verify.record.validation import array, fault, shown
from tbcad_verify.types import Bools, Floats, Ints

FIRST_ROW = 2  # its line in the file, below the header line
WIDEST = 200  # characters of a text
LARGEST = 1e12


class Columns(BaseModel):
    """A table: one field a column that is used, by its name, as arrays over the rows.

    Numbers are finite. A subclass sets the maximum number of rows. Other columns are not read.
    """

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True)
    most_rows: ClassVar[int]

    @classmethod
    def header(cls) -> tuple[str, ...]:
        """Names of the columns in the file."""
        return tuple(field.alias or name for name, field in cls.model_fields.items())

    @classmethod
    def read(cls, blob: FileBytes) -> Self:
        """The table in a file.

        BadExport: broken or truncated CSV, other columns, too few or too many rows, or a cell that
        is not allowed.
        """
        header, *rows = cls._rows(blob)
        cells = dict(zip(header, map(list, zip(*rows, strict=True)), strict=True))
        try:
            return cls.model_validate({name: cells[name] for name in cls.header()})
        except ValidationError as error:
            raise BadExport(f"{blob.name}: {fault(cls, error, _place)}; {AGAIN}") from error

    @classmethod
    def _rows(cls, blob: FileBytes) -> list[list[str]]:
        """The header line and the rows below it, all of its width."""
        try:
            header, *rows = list(csv.reader(io.StringIO(blob.text()), strict=True)) or [[]]
        except csv.Error as error:
            raise BadExport(f"{blob.name}: broken CSV ({error}); {AGAIN}") from error
        if missing := [name for name in cls.header() if name not in header]:
            raise BadExport(f"{blob.name}: the first line has no column {missing[0]}; {AGAIN}")
        twice = sorted({name for name in header if header.count(name) > 1})
        if twice:
            raise BadExport(f"{blob.name}: column {shown(twice[0])} is there twice; {AGAIN}")
        for line, row in enumerate(rows, FIRST_ROW):
            if len(row) != len(header):
                raise BadExport(
                    f"{blob.name}: line {line} has {len(row)} fields, not {len(header)}: "
                    f"truncated or foreign; {AGAIN}"
                )
        if not 1 <= len(rows) <= cls.most_rows:
            raise BadExport(
                f"{blob.name}: {len(rows)} rows; allowed are 1 to {cls.most_rows}; {AGAIN}"
            )
        return [header, *rows]

    def __len__(self) -> int:
        """Number of rows."""
        return len(getattr(self, next(iter(type(self).model_fields))))

    def columns(self, first: str, count: int = 1) -> Floats:
        """Consecutive columns of numbers, shape (count, rows)."""
        names = list(type(self).model_fields)
        start = names.index(first)
        return np.stack([getattr(self, name) for name in names[start : start + count]])


def _place(location: tuple[int | str, ...]) -> str:
    column, *row = location or ("",)
    return " ".join([*(f"line {int(k) + FIRST_ROW}:" for k in row[:1]), str(column)])


def column(cell: Any, kind: type[Any]) -> Any:
    """Validate every cell as this type, and make an array of this kind of number or text."""

    def build(cells: list[Any]) -> NDArray[Any]:
        return np.array(cells).astype(kind)

    return array(Annotated[list[cell], FailFast()], build)


def numbers(least: float, most: float) -> Any:
    """A column of numbers in a range."""
    return column(Annotated[float, Field(ge=least, le=most)], float)


def numbers_or_empty(least: float, most: float) -> Any:
    """A column of numbers in a range, NaN where the cell is empty."""
    cell = Annotated[float, Field(ge=least, le=most)] | None
    empty = BeforeValidator(lambda text: None if text == "" else text)
    return column(Annotated[cell, empty], float)


Counts = Annotated[Ints, column(Annotated[str, Field(pattern="^[0-9]{1,9}$")], np.int64)]
Texts = Annotated[NDArray[np.str_], column(Annotated[str, Field(max_length=WIDEST)], np.str_)]


Numbers = Annotated[Floats, numbers(-LARGEST, LARGEST)]
NumbersOrEmpty = Annotated[Floats, numbers_or_empty(-LARGEST, LARGEST)]


class Mirrors(Columns):
    """One mirror a row, M of them; centre and radius are NaN for planar mirrors."""

    most_rows: ClassVar[int] = 200_000

    id: Texts
    camera: Texts
    ux: Numbers
    uy: Numbers
    uz: Numbers
    px: Numbers
    py: Numbers
    pz: Numbers
    nx: Numbers
    ny: Numbers
    nz: Numbers
    cx: NumbersOrEmpty
    cy: NumbersOrEmpty
    cz: NumbersOrEmpty
    radius_mm: NumbersOrEmpty
    size_mm: Numbers
    theta0_deg: Numbers
    theta1_deg: Numbers
    polar_deg: Numbers
    azimuth_deg: Numbers
    cell_area_mm2: Numbers
    coverage_mm: Numbers

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Names of the mirrors."""
        return tuple(self.id.tolist())

    def take(self, index: NDArray[np.integer]) -> Mirrors:
        """The mirrors with these numbers, from 0, in this order."""
        columns = {name: getattr(self, name)[index] for name in Mirrors.model_fields}
        return Mirrors.model_construct(**columns)

    @property
    def flat(self) -> Bools:
        """(M,) true for planar mirrors, which have no radius."""
        return np.isnan(self.radius_mm)

    def surfaces(self) -> Surfaces:
        """The M reflecting surfaces, by apex, normal and radius."""
        curvature = np.where(self.flat, 0.0, 1 / np.where(self.flat, 1.0, self.radius_mm))
        return Surfaces(self.columns("px", 3), self.columns("nx", 3), curvature)
