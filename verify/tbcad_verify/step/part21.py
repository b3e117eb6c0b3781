"""Entities of a STEP file's text (ISO 10303-21), read without any CAD kernel.

What one kernel writes and reads can be wrong both times. Names, spheres, planes, holes and
validation properties are therefore taken from the text. A shell has 30,000 entities, of which the
verification needs a fifth: references and numbers are searched for in the text of those.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from tbcad_verify.types import Floats

# No expression tries again what it has read, so that the time grows with the length alone.
TEXT = r"'(?:[^']++|'')*+'"
ENTITY = re.compile(
    rf"\s*+#(\d{{1,15}}+)\s*+=\s*+([A-Z]\w*+)?\s*+\(((?:[^';=]++|{TEXT})*+);",
)
START = re.compile(r"\s*+ISO-10303-21;\s*+HEADER;")
HEADER_END = re.compile(rf"{TEXT}|(?P<end>ENDSEC;\s*+DATA;)|(?P<open>')")
END = re.compile(r"\s*+ENDSEC;\s*+END-ISO-10303-21;\s*+")
LABEL = re.compile(TEXT)
REFERENCE = re.compile(r"#(\d+)")
NUMBER = re.compile(r"[-+]?(?<!\d)\d++\.\d*+(?:E[-+]?\d++)?")  # begins at none but the first digit
SHOWN = 40  # characters of what cannot be read
TRIPLES = ("CARTESIAN_POINT", "DIRECTION")
# What lies below these is geometry, which refers to neither vertices nor faces (ISO 10303-42).
GEOMETRY = frozenset(
    (
        *(*TRIPLES, "AXIS2_PLACEMENT_3D"),
        *("LINE", "CIRCLE", "ELLIPSE", "HYPERBOLA", "B_SPLINE_CURVE_WITH_KNOTS"),
        *("PLANE", "SPHERICAL_SURFACE", "CYLINDRICAL_SURFACE", "CONICAL_SURFACE"),
    )
)


class StepTable:
    """The entities of a STEP file with one data section and no comments, by number.

    Attributes:
        head: text before the first of them.
        entities: name, empty for complex ones (units), and text of the parameters of each.
        kinds: name of each, but for complex ones.
        bodies: text of its parameters.
    """

    def __init__(self, text: str) -> None:
        """Find all entities.

        ValueError: the text is no STEP file, or two entities have one number.
        """
        start = _data_start(text)
        self.head, self.entities = text[:start], _entities(text, start)
        entities = self.entities
        self.kinds = {number: kind for number, (kind, _) in entities.items() if kind}
        self.bodies = {number: body for number, (kind, body) in entities.items() if kind}
        self._references: dict[int, list[int]] = {}
        self._topology: dict[int, list[int]] = {}

    def of(self, kind: str) -> list[int]:
        """Numbers of all entities of a kind, in the order of the file."""
        return [number for number, one in self.kinds.items() if one == kind]

    def label(self, number: int) -> str:
        """First text of an entity: its name."""
        return str(LABEL.findall(self.bodies[number])[0])[1:-1].replace("''", "'")

    def forward(self, face: int) -> bool:
        """Whether a face has its surface's sense."""
        return self.bodies[face].rstrip().endswith(".T.")

    def references(self, number: int) -> list[int]:
        """Numbers of what an entity refers to."""
        if number not in self._references:
            digits = REFERENCE.findall(self.bodies.get(number, ""))
            self._references[number] = [int(one) for one in digits]
        return self._references[number]

    def numbers(self, number: int) -> list[float]:
        """Decimal numbers in an entity. ValueError: one is beyond all floats."""
        values = [float(digits) for digits in NUMBER.findall(self.bodies[number])]
        if not all(map(math.isfinite, values)):
            raise ValueError(f"a number in {self.bodies[number][:SHOWN]!r} is too large")
        return values

    def reached(self, *start: int) -> Iterator[int]:
        """Some entities, all that they refer to, and what these refer to, each once.

        But for points, curves and surfaces, which are two thirds of a file.
        """
        seen, todo = set(start), list(start)
        while todo:
            number = todo.pop()
            yield number
            if references := self._but_geometry(number):
                new = [one for one in references if one not in seen]
                seen.update(new)
                todo += new

    def _but_geometry(self, number: int) -> list[int]:
        if number not in self._topology:
            kinds = self.kinds
            self._topology[number] = [
                one for one in self.references(number) if kinds.get(one) not in GEOMETRY
            ]
        return self._topology[number]

    def triple(self, number: int) -> Floats:
        """(3,) of a point or direction. ValueError: it is neither."""
        values = self.numbers(number)
        if self.kinds[number] not in TRIPLES or len(values) != 3:
            raise ValueError(f"{self.kinds[number]} where a point or direction must be")
        return np.array(values)

    def placement(self, number: int) -> tuple[Floats, Floats]:
        """Origin and axis of a placement."""
        point, axis = self.references(number)[:2]
        return self.triple(point), self.triple(axis)


def _entities(text: str, place: int) -> dict[int, tuple[str, str]]:
    """Name and text of the parameters of each entity from a place on."""
    if "/*" in text:
        raise ValueError("broken STEP text: a comment")
    numbers = 0
    entities: dict[int, tuple[str, str]] = {}
    while (match := ENTITY.match(text, place)) and (inside := match[3].rstrip()).endswith(")"):
        plain = LABEL.sub("", inside)
        if plain.count("(") + 1 != plain.count(")"):
            break
        numbers, place = numbers + 1, match.end()
        entities[int(match[1])] = (match[2] or "", inside[:-1])
    if not END.fullmatch(text, place):
        raise ValueError(f"broken STEP text at {text[place : place + SHOWN].strip()!r}")
    if len(entities) < numbers:
        raise ValueError("broken STEP text: two entities have one number")
    return entities


def _data_start(text: str) -> int:
    """Where the first entity begins."""
    start = START.match(text)
    for found in HEADER_END.finditer(text, start.end()) if start else ():
        if found["end"]:
            return found.end()
        if found["open"]:
            break
    raise ValueError("broken STEP text: no header and data section")
