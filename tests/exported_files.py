"""Files of an export that tests read, compare and change."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

Rows = list[dict[str, str]]


def contents(folder: Path) -> dict[str, bytes]:
    """The bytes of all files by name, those of folders in it too."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def edit_json(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change a JSON object in place."""
    value = json.loads(path.read_text(encoding="utf-8"))
    change(value)
    path.write_text(json.dumps(value), encoding="utf-8")


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
