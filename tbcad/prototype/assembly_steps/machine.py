"""A prototype as its export describes it: bodies, fasteners and the list of parts."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from tbcad.errors import InputError
from tbcad.formats.checked_files import parse_json
from tbcad.formats.csv_table import Row
from tbcad.prototype.electronics import wiring
from tbcad.prototype.files.bom_view import read_parts_list
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, load_parts
from tbcad.spec.csv_rows import read_rows
from tbcad.spec.files import read_text

RECORD, WIRING = "prototype.json", "wiring.csv"
SCHEMA = "tbcad-prototype/2"
NEEDED = ("parts", "bought", "fasteners", "home", "drive", "holding", "controller", "frame_stock")
UNIT_PARTS = ("strips", "sheets")  # kinds that are counted by the metre or sheet, not by bodies
RESISTORS, OWN = "resistors", "own"

Record = dict[str, Any]


@dataclass(frozen=True)
class Machine:
    """What a prototype consists of.

    Attributes:
        rows: of its list of parts.
        record: prototype.json.
        wiring: lines of wiring.csv.
        sizes: diameter text of each purchased ball by its number, as in the list of parts.
        parts: tbcad's lists of purchased parts.
    """

    rows: tuple[Row, ...]
    record: Record
    wiring: tuple[dict[str, str], ...]
    sizes: dict[int, str]
    parts: Parts

    @cached_property
    def items(self) -> dict[str, int]:
        """Number in the list of each part."""
        return {str(row["part"]): int(row["item"] or 0) for row in self.rows}

    @cached_property
    def quantities(self) -> dict[str, int]:
        """Quantity of each part."""
        return {str(row["part"]): int(row["quantity"] or 0) for row in self.rows}

    @cached_property
    def bodies(self) -> dict[str, str]:
        """Part of each body that is no fastener; empty for what the list does not have."""
        printed = {one["name"]: _listed_name(one) for one in self.record["parts"]}
        bought = {one["name"]: one["part"] or "" for one in self.record["bought"]}
        balls = {f"ball_{number}": f"ball {size}" for number, size in self.sizes.items()}
        shroud = self.record.get("shroud") or {"panels": []}
        panels = {one["name"]: shroud["sheet"] for one in shroud["panels"]}
        return {**printed, **bought, **balls, **panels}

    @property
    def fasteners(self) -> list[Record]:
        """Records of screws, inserts, magnets and the like."""
        return list(self.record["fasteners"])

    def has(self, body: str) -> bool:
        """Whether there is such a body."""
        return body in self.bodies

    def is_printed(self, body: str) -> bool:
        """Whether a body is made of plastic."""
        return any(one["name"] == body for one in self.record["parts"])

    def listed(self, part: str) -> PurchasedPart | None:
        """A part of tbcad's lists; None of others, such as balls and printed ones."""
        return self.parts.get(part)

    def kind(self, part: str) -> str:
        """The list that a part is in, such as screws; own where it is in none."""
        if any(row["resistor"] == part for row in self.wiring):
            return RESISTORS
        found = self.parts.get(part)
        return found.kind if found else OWN

    def by_body(self, part: str) -> bool:
        """Whether each body of a part is one of its pieces in the list."""
        return bool(part) and self.kind(part) not in UNIT_PARTS

    def ref(self, part: str) -> str:
        """A part with its number in the list, for a text."""
        return f"{part} ({self.items[part]})" if part in self.items else part

    def body_ref(self, body: str) -> str:
        """A body's part with its number in the list."""
        return self.ref(self.bodies[body])


def read_machine(folder: Path) -> Machine:
    """The prototype of an export.

    Raises:
        InputError: a file is missing or broken, or was written by an earlier version.
    """
    rows = read_parts_list(folder).rows
    record = _record(folder / RECORD)
    lines = [row for _, row in read_rows(_present(folder / WIRING), WIRING, wiring.COLUMNS)]
    return Machine(rows, record, tuple(lines), _ball_sizes(folder, record), load_parts())


def _record(path: Path) -> Record:
    try:
        record = parse_json(read_text(_present(path), RECORD, "record"))
    except ValueError as error:
        raise InputError(f"{path} is no JSON ({error}): build again") from None
    if not isinstance(record, dict) or record.get("schema") != SCHEMA:
        raise InputError(f"{path} has another schema than {SCHEMA}: build again")
    if missing := [key for key in NEEDED if key not in record]:
        raise InputError(f"{path} has no {missing[0]}: build again with this version of tbcad")
    return record


def _ball_sizes(folder: Path, record: Record) -> dict[int, str]:
    path = _present(folder / str(record.get("balls")))
    lines = read_text(path, path.name, "list").splitlines()
    header = lines[0].split(",") if lines else []
    columns: Sequence[str] = ("number", "kind", "size")
    if header[: len(columns)] != list(columns):
        raise InputError(
            f"{path}, line 1: the first columns must be {','.join(columns)}: build again"
        )
    cells = [line.split(",")[: len(columns)] for line in lines[1:] if line]
    return {int(number): size for number, kind, size in cells if kind != "cap"}


def _present(path: Path) -> Path:
    if not path.is_file():
        raise InputError(f"{path} is not there: name a folder with a prototype by tbcad build")
    return path


def _listed_name(part: Record) -> str:
    """The name that the list has for a printed part."""
    return f"cap {part['ball']}" if part["role"] == "cap" else str(part["name"])
