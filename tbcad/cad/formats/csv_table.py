"""CSV files as tbcad writes them: UTF-8, one header line, numbers in full double precision."""

import csv
from collections.abc import Iterable
from pathlib import Path

Cell = str | int | float | None
Row = dict[str, Cell]


def write_table(path: Path, columns: tuple[str, ...], rows: Iterable[Row]) -> None:
    """Write rows under a header line, None as an empty cell; ValueError if a key is no column."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
