"""Tables of a part's sheet: its round holes and slots, their fits, the carrier's seats.

Fits are what goes into holes with little play, or is pressed in, glued in or reamed for.
Sizes are those of the solid and of tbcad's lists of purchased parts.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from tbcad.cad.drafting.sheet import TABLE_ROW_MM, is_legible, table
from tbcad.cad.drafting.views import ABOVE, FRONT, LEFT, Shape
from tbcad.cad.formats.entities import Entity, Point
from tbcad.cad.kernel.features import HOLE_DEG, SLOT_DEG, RoundFace, distance
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

VIEWS = {"A": FRONT, "B": ABOVE, "C": LEFT}  # by the letter of their holes
TILTED = "T"
HEAD = ("hole", "Ø", "x", "y", "z", "depth", "is for, or axis")
WIDTHS_MM = (9.0, 11.0, 14.0, 14.0, 14.0, 13.0, 40.0)
PARALLEL_COS, NEAR_MM, SAME_MM = 1 - 1e-6, 0.1, 1e-3
BETWEEN_ROWS, LEAST_ROWS = 1, 2  # empty ones between tables; of a table that is cut, with its head

FITS_HEAD = ("fits", "Ø", "takes", "its Ø", "play", "how")
FITS_WIDTHS_MM = (30.0, 12.0, 29.0, 12.0, 10.0, 22.0)
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
FIT_MM = 0.55  # of a hole's diameter from what the part is made for; others have play for screws
REAMED, REAM = re.compile(r"\bream its bore [0-9.]+ (H[0-9]+)\b"), "ream "
TOLERANCE = re.compile(r"\b[0-9.]+ ([a-z][0-9]+) x ")  # such as 8 h6 x 120
SEATS_HEAD = ("seat", "is for", "R", "x", "y", "z", "3 pads")
SEATS_WIDTHS_MM = (9.0, 28.0, 15.0, 17.0, 17.0, 17.0, 12.0)
ON_PART_MM = 0.5  # of a pad's place from the part, offset as the coupon asks
Row: TypeAlias = tuple[str, ...]
Fastener: TypeAlias = tuple[str, Floats, Floats]
"""Part, place and direction of what a screw hole is for."""


@dataclass(frozen=True)
class DrawnHole:
    """A hole or slot."""

    cylinder: RoundFace  # its wall; of a slot one end's
    mouth: Floats  # middle of its end toward the eye, mm, (3,)
    view: str  # letter of the view in which it is round, or else the nearest to that
    # from the middle of the slot's end to that of the other, mm, (3,); zero for a hole
    slot: Floats
    takes: str  # name of the part that goes in, empty where none does

    @property
    def is_tilted(self) -> bool:
        """Whether no view shows it round."""
        return bool(abs(VIEWS[self.view][2] @ self.cylinder.axis) < PARALLEL_COS)

    @property
    def through(self) -> bool:
        """Whether both ends are open."""
        return self.cylinder.open_start and self.cylinder.open_end


def numbered_holes(
    cylinders: Sequence[RoundFace], fasteners: Iterable[Fastener]
) -> list[tuple[str, DrawnHole]]:
    """Holes and slots with their numbers, such as B3: by view, then from left to right."""
    screws = list(fasteners)
    whole = [one for one in cylinders if one.hollow and one.turn_deg >= HOLE_DEG]
    ends = [one for one in cylinders if one.hollow and SLOT_DEG <= one.turn_deg < HOLE_DEG]
    holes = [_hole(one, np.zeros(3), screws) for one in whole]
    holes += [_hole(one, along, screws) for one, along in _slots(ends)]
    count: dict[str, int] = {}
    numbered = []
    for hole in sorted(holes, key=_order):
        letter = TILTED if hole.is_tilted else hole.view
        count[letter] = count.get(letter, 0) + 1
        numbered.append((f"{letter}{count[letter]}", hole))
    return numbered


def table_rows(number: str, hole: DrawnHole) -> Iterator[tuple[str, ...]]:
    """The row of a hole in the table, below HEAD, and a second one for what has no room in it."""
    wall = hole.cylinder
    depth = "through" if hole.through else mm(wall.length)
    place = (f"{value + 0.0:.2f}" for value in np.round(hole.mouth, 2).tolist())
    remarks = _remarks(hole)
    first, *others = (
        [" ".join(remarks)] if is_legible(" ".join(remarks), WIDTHS_MM[-1]) else remarks
    )
    yield number, mm(2 * wall.radius), *place, depth, first
    for one in others:
        yield *("" for _ in HEAD[1:]), one


def mm(value: float) -> str:
    """A length with two digits after the point at most."""
    return f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".")


def _remarks(hole: DrawnHole) -> list[str]:
    """Remarks on a hole: slot, mating part, axis if tilted."""
    found = [hole.takes] if hole.takes else []
    if np.any(hole.slot):
        length = float(np.linalg.norm(hole.slot)) + 2 * hole.cylinder.radius
        slot = f"slot {mm(2 * hole.cylinder.radius)} x {mm(length)}"
        return [f"{slot},", *found] if found else [slot]
    if hole.is_tilted:
        x, y, z = (np.round(hole.cylinder.axis, 3) + 0.0).tolist()
        found.append(f"({x:.3f} {y:.3f} {z:.3f})")
    return found or [""]


def _order(hole: DrawnHole) -> tuple[bool, str, tuple[float, ...]]:
    place = VIEWS[hole.view] @ hole.mouth
    return hole.is_tilted, hole.view, tuple(np.round(place, 2).tolist())


def _hole(wall: RoundFace, slot: Floats, fasteners: Iterable[Fastener]) -> DrawnHole:
    view = max(VIEWS, key=lambda one: round(abs(float(VIEWS[one][2] @ wall.axis)), 6))
    near_end = float(VIEWS[view][2] @ wall.axis) > 0
    front, back = (wall.end, wall.start) if near_end else (wall.start, wall.end)
    opened = wall.open_end if near_end else wall.open_start
    back_opened = wall.open_start if near_end else wall.open_end
    mouth = front if opened or not back_opened else back
    takes = {part for part, place, along in fasteners if is_coaxial(wall, place, along, slot)}
    return DrawnHole(wall, mouth + slot / 2, view, slot, " ".join(sorted(takes)))


def is_coaxial(wall: RoundFace, place: Floats, along: Floats, slot: Floats | None = None) -> bool:
    """Whether a line is the axis of a hole, or lies between a slot's ends."""
    axis, offset = wall.axis, place - wall.start
    off = offset - (offset @ axis) * axis
    if slot is not None and np.any(slot):
        off = off - np.clip(off @ slot / float(slot @ slot), 0.0, 1.0) * slot
    return bool(abs(along @ axis) >= PARALLEL_COS and np.linalg.norm(off) < NEAR_MM)


def _slots(ends: Sequence[RoundFace]) -> list[tuple[RoundFace, Floats]]:
    """Pairs of half cylinders that are the ends of slots, and the way from one to the other."""
    left, found = list(ends), []
    while left:
        first = left.pop(0)
        partners = [one for one in left if _is_partner(first, one)]
        if not partners:
            continue
        other = min(partners, key=lambda one: float(np.linalg.norm(one.start - first.start)))
        left = [one for one in left if one is not other]
        found.append((first, np.asarray(other.start - first.start)))
    return found


def _is_partner(one: RoundFace, other: RoundFace) -> bool:
    """Whether two ends belong to one slot: one radius, side by side."""
    if abs(one.radius - other.radius) > SAME_MM or abs(one.axis @ other.axis) < PARALLEL_COS:
        return False
    along = other.start - one.start
    return bool(abs(along @ one.axis) < SAME_MM and abs(one.length - other.length) < SAME_MM)


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
    """The mating part of a hole."""

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
    rows = [
        (" ".join(numbers[start : start + NUMBERS]), *cells)
        for cells, numbers in alike.items()
        for start in range(0, len(numbers), NUMBERS)
    ]
    return SheetTable(FITS_HEAD, FITS_WIDTHS_MM, tuple(rows))


def _takes(hole: DrawnHole, mate: Mate) -> bool:
    diameter = 2 * hole.cylinder.radius
    return (
        not np.any(hole.slot)
        and abs(diameter - mate.hole) < FIT_MM
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
