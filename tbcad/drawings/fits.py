"""Tables of a part's sheet: its fits, and on the carrier's the seats of balls and caps.

Fits are what goes into holes with little play, or is pressed in, glued in or reamed for.
Sizes are those of the solid and of tbcad's lists of purchased parts.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tbcad.cad.drafting.sheet import TABLE_ROW_MM, table
from tbcad.cad.formats.entities import Entity, Point
from tbcad.cad.kernel.features import distance
from tbcad.cad.kernel.projection import Shape
from tbcad.drawings.holes import DrawnHole, is_coaxial, mm
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

BETWEEN_ROWS, LEAST_ROWS = 1, 2  # empty ones between tables; of a table that is cut, with its head

Row = tuple[str, ...]
HEAD = ("fits", "Ø", "takes", "its Ø", "play", "how")
WIDTHS_MM = (30.0, 12.0, 29.0, 12.0, 10.0, 22.0)
NUMBERS = 5  # of holes in a row
# Size of each kind of part that fits, the hole it is made for, and how it is held.
KINDS = {
    "magnets": ("diameter_mm", "diameter_mm", "glue in"),
    "dowels": ("diameter_mm", "diameter_mm", ""),
    "leds": ("flange_mm", "flange_mm", ""),
    "inserts": ("outer_mm", "hole_mm", "press in hot"),
    "shafts": ("diameter_mm", "diameter_mm", ""),
    "bearings": ("outer_mm", "outer_mm", "press in"),
}
NEAR_MM = 0.55  # of a hole's diameter from what the part is made for; others have play for screws
REAMED, REAM = re.compile(r"\bream its bore [0-9.]+ (H[0-9]+)\b"), "ream "
TOLERANCE = re.compile(r"\b[0-9.]+ ([a-z][0-9]+) x ")  # such as 8 h6 x 120
SEATS_HEAD = ("seat", "is for", "R", "x", "y", "z", "3 pads")
SEATS_WIDTHS_MM = (9.0, 28.0, 15.0, 17.0, 17.0, 17.0, 12.0)
ON_PART_MM = 0.5  # of a pad's place from the part, offset as the coupon asks


@dataclass(frozen=True)
class SheetTable:
    """A table of a column."""

    head: Row  # what the columns are
    widths: tuple[float, ...]  # of the columns, mm
    rows: tuple[Row, ...]  # below the head


def in_columns(tables: Sequence[SheetTable], first: int, others: int) -> list[list[SheetTable]]:
    """Tables in columns, the first and the others with room for so many rows; long ones are cut."""
    columns: list[list[SheetTable]] = [[]]
    room = first
    for one in tables:
        rest = one
        while rest.rows:
            whole = 1 + len(rest.rows)
            if room < LEAST_ROWS or (room < whole <= others and columns[-1]):
                columns.append([])
                room = others
            taken = rest.rows[: room - 1]
            columns[-1].append(replace(rest, rows=taken))
            rest = replace(rest, rows=rest.rows[len(taken) :])
            room -= 1 + len(taken) + BETWEEN_ROWS
    return columns


def drawn(corner: Point, tables: Sequence[SheetTable]) -> Iterator[Entity]:
    """A column of tables below and right of a corner."""
    x, y = corner
    for one in tables:
        yield from table((x, y), one.widths, (one.head, *one.rows))
        y -= (1 + len(one.rows) + BETWEEN_ROWS) * TABLE_ROW_MM


@dataclass(frozen=True)
class Mate:
    """What goes into a hole."""

    name: str  # of the part
    place: Floats  # on its axis, mm, (3,)
    along: Floats  # its axis, a unit vector, (3,)
    size: float  # its diameter, mm
    hole: float  # diameter of the hole that it is made for, mm
    tolerance: str = ""  # of its diameter, such as h6; empty where none is known
    how: str = ""  # it is held
    # tolerance that its hole is reamed to, such as H7; empty where it stays as printed
    reamed: str = ""


def purchased_mate(
    part: PurchasedPart | None, place: Floats, along: Floats, reamed: str = ""
) -> Mate | None:
    """A purchased part in its hole; None of kinds that have play, such as screws."""
    if part is None or part.kind not in KINDS:
        return None
    size, hole, how = KINDS[part.kind]
    found = TOLERANCE.search(part.what)
    tolerance = found[1] if found else ""
    return Mate(part.name, place, along, part[size], part[hole], tolerance, how, reamed)


def reamed_to(what: str) -> str:
    """The tolerance that a part's description wants its bore reamed to; empty without one."""
    found = REAMED.search(what)
    return found[1] if found else ""


def fits_table(holes: Sequence[tuple[str, DrawnHole]], mates: Sequence[Mate]) -> SheetTable:
    """Holes that take a part, those alike in a row."""
    alike: dict[Row, list[str]] = {}
    for number, hole in holes:
        for cells in sorted({_cells(hole, mate) for mate in mates if _takes(hole, mate)}):
            alike.setdefault(cells, []).append(number)
    return SheetTable(HEAD, WIDTHS_MM, tuple(_rows(alike)))


def _rows(alike: Mapping[Row, Sequence[str]]) -> Iterator[Row]:
    for cells, numbers in alike.items():
        for start in range(0, len(numbers), NUMBERS):
            yield " ".join(numbers[start : start + NUMBERS]), *cells


def _takes(hole: DrawnHole, mate: Mate) -> bool:
    diameter = 2 * hole.cylinder.radius
    return (
        not np.any(hole.slot)
        and abs(diameter - mate.hole) < NEAR_MM
        and is_coaxial(hole.cylinder, mate.place, mate.along)
    )


def _cells(hole: DrawnHole, mate: Mate) -> Row:
    diameter = 2 * hole.cylinder.radius
    reamed = mate.reamed and mm(diameter) == mm(mate.size)
    size = f"{mm(diameter)} {mate.reamed}" if reamed else mm(diameter)
    own = f"{mm(mate.size)} {mate.tolerance}".strip()
    how = f"{REAM}{mate.reamed}" if reamed else mate.how
    return size, mate.name, own, mm(diameter - mate.size), how


@dataclass(frozen=True)
class ListedSeat:
    """A seat."""

    number: int  # of its ball
    takes: str  # what lies in it
    radius: float  # of the body's sphere, mm
    centre: Floats  # of that, mm, (3,)
    axis: Floats  # of the seat, a unit vector, (3,)
    contacts: Floats  # with the pads, mm, (3, 3)
    pad: float  # diameter of the pads, mm


def seats_table(shape: Shape, seats: Sequence[ListedSeat]) -> SheetTable:
    """The seats whose pads are on a part, places in the part's frame."""
    rows = [
        (
            str(one.number),
            one.takes,
            f"{one.radius:.3f}",
            *(f"{value + 0.0:.2f}" for value in np.round(one.centre, 2).tolist()),
            f"Ø{mm(one.pad)}",
        )
        for one in seats
        if all(distance(shape, contact) < ON_PART_MM for contact in one.contacts)
    ]
    return SheetTable(SEATS_HEAD, SEATS_WIDTHS_MM, tuple(rows))
