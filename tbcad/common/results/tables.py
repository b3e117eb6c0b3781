"""Tables of figures, written as CSV; units are in the names of the columns."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO

import numpy as np
from numpy.typing import ArrayLike

from tbcad.types import Floats

Cell = str | int | float | None
Record = dict[str, Cell]


@dataclass(frozen=True)
class Table:
    """A table."""

    name: str  # of its file, without the ending
    columns: tuple[str, ...]  # names; units are in them
    rows: tuple[tuple[Cell, ...], ...]  # cells in the columns' order; None where there is no value
    notes: tuple[str, ...] = ()  # what the figures mean and assume, a sentence or two each

    @staticmethod
    def of_columns(
        name: str, columns: Mapping[str, ArrayLike], notes: tuple[str, ...] = ()
    ) -> "Table":
        """A table of columns of one length; NaN becomes an empty cell."""
        values = [np.asarray(column).tolist() for column in columns.values()]
        rows = tuple(tuple(map(_cell, row)) for row in zip(*values, strict=True))
        return Table(name, tuple(columns), rows, notes)

    @staticmethod
    def of_records(
        name: str,
        records: Sequence[Record],
        notes: tuple[str, ...] = (),
        columns: tuple[str, ...] = (),
    ) -> "Table":
        """A table of rows with the same keys; `columns` are needed where there may be no row."""
        names = columns or tuple(records[0])
        return Table(name, names, tuple(tuple(map(r.__getitem__, names)) for r in records), notes)

    def records(self) -> list[Record]:
        """The rows by the names of the columns."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]

    def column(self, name: str) -> list[Cell]:
        """The cells of one column."""
        place = self.columns.index(name)
        return [row[place] for row in self.rows]

    def numbers(self, name: str) -> Floats:
        """The cells of one column as numbers, (k,); NaN where there is no value."""
        return np.array([math.nan if c is None else float(c) for c in self.column(name)])

    def where(self, **cells: Cell) -> "Table":
        """The rows that have these cells in these columns."""
        places = {self.columns.index(name): cell for name, cell in cells.items()}
        rows = (r for r in self.rows if all(r[place] == cell for place, cell in places.items()))
        return Table(self.name, self.columns, tuple(rows), self.notes)


def csv_text(table: Table) -> str:
    """A table as CSV, numbers in full precision; a cell without a value is empty."""
    file = StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return file.getvalue()


def _cell(value: Cell) -> Cell:
    return None if isinstance(value, float) and math.isnan(value) else value
