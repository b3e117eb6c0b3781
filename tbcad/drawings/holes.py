"""Round holes and slots of a part: their numbers, sizes and places for a drawing's table."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.cad.drafting.sheet import is_legible
from tbcad.cad.drafting.views import ABOVE, FRONT, LEFT
from tbcad.cad.kernel.features import HOLE_DEG, SLOT_DEG, RoundFace
from tbcad.types import Floats

VIEWS = {"A": FRONT, "B": ABOVE, "C": LEFT}  # by the letter of their holes
TILTED = "T"
HEAD = ("hole", "Ø", "x", "y", "z", "depth", "is for, or axis")
WIDTHS_MM = (9.0, 11.0, 14.0, 14.0, 14.0, 13.0, 40.0)
PARALLEL_COS, NEAR_MM, SAME_MM = 1 - 1e-6, 0.1, 1e-3


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


Fastener = tuple[str, Floats, Floats]
"""Part, place and direction of what a screw hole is for."""


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
    """What a slot is, what goes in, and the axis of a tilted hole."""
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
