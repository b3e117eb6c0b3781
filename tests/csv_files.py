"""CSV files that tests read and change."""

import csv
from collections.abc import Callable
from pathlib import Path

Rows = list[dict[str, str]]


def read_csv(path: Path) -> Rows:
    """The rows below the header line, as text."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def edit_csv(path: Path, change: Callable[[Rows], object]) -> None:
    """Change the rows in place; the columns are then those of the first row."""
    rows = read_csv(path)
    columns = list(rows[0])
    change(rows)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0] if rows else columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
