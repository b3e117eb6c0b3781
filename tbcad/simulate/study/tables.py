"""Tables of figures, written as CSV."""

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from io import StringIO

Cell = str | int | float | None

SUMMARY = ("quantity", "unit", "tbcad", "paper", "where")


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        name: of its file, without the ending.
        columns: names; units are in them.
        rows: cells in the columns' order; None where there is no value.
        notes: what the figures mean and assume, a sentence or two each.
    """

    name: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...] = ()

    def column(self, name: str) -> list[Cell]:
        """The cells of one column."""
        place = self.columns.index(name)
        return [row[place] for row in self.rows]

    def numbers(self, name: str) -> list[float]:
        """The cells of one column as numbers, NaN where there is no value."""
        return [math.nan if cell is None else float(cell) for cell in self.column(name)]


def csv_text(table: Table) -> str:
    """A table as CSV, numbers in full precision; a cell without a value is empty."""
    file = StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return file.getvalue()


def joined(rows: Iterable[Iterable[Cell]]) -> tuple[tuple[Cell, ...], ...]:
    """Rows as a table holds them."""
    return tuple(tuple(row) for row in rows)
