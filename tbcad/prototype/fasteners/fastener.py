"""A small purchased part in its place, in the frame of the shell.

What is bought is counted from these records, drawn from them, and verified against the holes.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats


@dataclass(frozen=True)
class Fastener:
    """A screw, set screw, washer, nut, insert, dowel, magnet or LED.

    Attributes:
        part: from the lists.
        place: the point of its axis from which its body goes along, mm, (3,); of a screw and a
            washer it is on the face that they press on.
        along: unit vector in which it goes in, (3,).
        through: names of the bodies that it goes through and into, in this order.
        name: of its body, unique; empty until all are numbered.
        rotates: whether it rotates with the base.
    """

    part: PurchasedPart
    place: Floats
    along: Floats
    through: tuple[str, ...]
    name: str = ""
    rotates: bool = False


def numbered(fasteners: Iterable[Fastener]) -> tuple[Fastener, ...]:
    """Fasteners named by their part and a number from 1, such as M5x12_3 or INSERT_M3_1."""
    counts: dict[str, int] = {}
    named = []
    for one in fasteners:
        number = counts[one.part.name] = counts.get(one.part.name, 0) + 1
        named.append(replace(one, name=re.sub(r"\W", "_", f"{one.part.name}_{number}")))
    return tuple(named)
