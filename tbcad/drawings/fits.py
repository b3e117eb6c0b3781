"""Fits: what goes into a part's holes with little play, or is pressed in, glued in or reamed for.

Sizes are those of the solid and of tbcad's lists of purchased parts.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.drawings.columns import Row, Table
from tbcad.drawings.holes import Hole, is_coaxial, mm
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

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


@dataclass(frozen=True)
class Mate:
    """What goes into a hole.

    Attributes:
        name: of the part.
        place: on its axis, mm, (3,).
        along: its axis, a unit vector, (3,).
        size: its diameter, mm.
        hole: diameter of the hole that it is made for, mm.
        tolerance: of its diameter, such as h6; empty where none is known.
        how: it is held.
        reamed: tolerance that its hole is reamed to, such as H7; empty where it stays as printed.
    """

    name: str
    place: Floats
    along: Floats
    size: float
    hole: float
    tolerance: str = ""
    how: str = ""
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


def fits_table(holes: Sequence[tuple[str, Hole]], mates: Sequence[Mate]) -> Table:
    """Holes that take a part, those alike in a row."""
    alike: dict[Row, list[str]] = {}
    for number, hole in holes:
        for cells in sorted({_cells(hole, mate) for mate in mates if _takes(hole, mate)}):
            alike.setdefault(cells, []).append(number)
    return Table(HEAD, WIDTHS_MM, tuple(_rows(alike)))


def _rows(alike: Mapping[Row, Sequence[str]]) -> Iterator[Row]:
    for cells, numbers in alike.items():
        for start in range(0, len(numbers), NUMBERS):
            yield " ".join(numbers[start : start + NUMBERS]), *cells


def _takes(hole: Hole, mate: Mate) -> bool:
    diameter = 2 * hole.cylinder.radius
    return (
        not np.any(hole.slot)
        and abs(diameter - mate.hole) < NEAR_MM
        and is_coaxial(hole.cylinder, mate.place, mate.along)
    )


def _cells(hole: Hole, mate: Mate) -> Row:
    diameter = 2 * hole.cylinder.radius
    reamed = mate.reamed and mm(diameter) == mm(mate.size)
    size = f"{mm(diameter)} {mate.reamed}" if reamed else mm(diameter)
    own = f"{mm(mate.size)} {mate.tolerance}".strip()
    how = f"{REAM}{mate.reamed}" if reamed else mate.how
    return size, mate.name, own, mm(diameter - mate.size), how
