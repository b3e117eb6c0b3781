"""Strict CSV tables: a fixed header, trimmed cells, and errors that name line and column."""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path

from tbcad.spec.errors import SpecError, short_text
from tbcad.spec.files import read_text

Row = dict[str, str]
"""Cells by column."""


def read_rows(
    file: Path | Traversable, name: str, columns: Sequence[str]
) -> Iterator[tuple[str, Row]]:
    """Yield each row that is not empty, with its place as text for error messages.

    Args:
        file: UTF-8 text, with or without a byte order mark.
        name: of the file in error messages.
        columns: that the header must list, in this order.

    Raises:
        SpecError: when the file cannot be read or is not such a table; it names the line.
    """
    reader = csv.reader(io.StringIO(read_text(file, name, "list"), newline=""), strict=True)
    try:
        header = [cell.strip() for cell in next(reader, [])]
        if header != list(columns):
            raise SpecError(f"{name}, line 1: the columns must be {','.join(columns)}: change it")
        for cells in reader:
            where = f"{name}, line {reader.line_num}"
            if len(cells) not in (0, len(columns)):
                raise SpecError(f"{where}: {len(cells)} columns, not {len(columns)}: correct it")
            if cells:
                yield where, dict(zip(columns, map(str.strip, cells), strict=True))
    except csv.Error as error:
        raise SpecError(f"{name}, line {reader.line_num}: {error}: correct it") from None


def required_text(where: str, row: Row, column: str) -> str:
    """Return a cell that must not be empty.

    Raises:
        SpecError: when it is; it names the place and the column.
    """
    if not row[column]:
        raise SpecError(f"{where}, column {column}: empty: fill it in")
    return row[column]


def positive_number(where: str, row: Row, column: str, maximum: float) -> float:
    """Return a cell that must be a number above 0 and at most a maximum.

    Raises:
        SpecError: when it is not; it names the place, the column and what is allowed.
    """
    try:
        value = float(row[column])
    except ValueError:
        value = math.nan
    if not 0 < value <= maximum:
        raise SpecError(
            f"{where}, column {column}: {short_text(row[column])}, allowed is a number above 0 to "
            f"{maximum:g}: change it"
        )
    return value


def check_unique(where: str, row: Row, column: str, known: set[str]) -> None:
    """Add a cell to the values that a column already has.

    Raises:
        SpecError: when it is one of them; it names the place and the column.
    """
    if row[column] in known:
        raise SpecError(f"{where}, column {column}: {short_text(row[column])} twice: remove one")
    known.add(row[column])
