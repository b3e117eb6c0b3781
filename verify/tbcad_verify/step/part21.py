"""Entities of a STEP file's text (ISO 10303-21), read without any CAD kernel.

What one kernel writes and reads can be wrong both times. Names, spheres, planes, holes and
validation properties are therefore taken from the text. An entity must be written as a build has
it, `#1 = NAME(...);` with a line's end. A shell has 30,000, of which the verification needs a
fifth: references and numbers are searched for in the text of those.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from tbcad_verify.types import Floats

# No expression tries again what it has read, so that the time grows with the length alone.
TEXT = r"'(?:[^']++|'')*+'"
# An entity, or all that is left where none is.
ENTITY = re.compile(
    rf"#(\d{{1,15}}+) ?= ?([A-Z]\w*+)?\(((?:[^';]*+{TEXT})*+[^';]*)\);\n|((?s:.++))"
)
START = re.compile(r"\s*+ISO-10303-21;\s*+HEADER;")
HEADER_END = re.compile(rf"{TEXT}|(?P<end>ENDSEC;\s*+DATA;\n)|(?P<open>')")
END = re.compile(r"ENDSEC;\s*+END-ISO-10303-21;\s*+")
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
        numbered: numbers of the entities of each kind, in the order of the file; of complex ones
            (units), the kind is empty.
        kinds: name of each, but for complex ones.
        bodies: text of the parameters of each.
    """

    def __init__(self, text: str) -> None:
        """Find all entities.

        ValueError: the text is no STEP file, or two entities have one number.
        """
        plain = LABEL.sub("", text)
        if "/*" in plain:
            raise ValueError("broken STEP text: a comment")
        start = _data_start(text)
        *entities, (_, _, _, rest) = ENTITY.findall(text, start) or [("", "", "", "")]
        if not END.fullmatch(rest):
            raise ValueError(f"broken STEP text at {rest[:SHOWN].strip()!r}")
        if plain.count("(") != plain.count(")"):
            raise ValueError("broken STEP text: a bracket too many")
        self.head = text[:start]
        self.bodies: dict[int, str] = {int(number): body for number, _, body, _ in entities}
        self.kinds: dict[int, str] = {int(number): kind for number, kind, _, _ in entities if kind}
        if len(self.bodies) < len(entities):
            raise ValueError("broken STEP text: two entities have one number")
        self.numbered: dict[str, list[int]] = {}
        for number, (_, kind, _, _) in zip(self.bodies, entities, strict=True):
            self.numbered.setdefault(kind, []).append(number)
        self._references: dict[int, list[int]] = {}
        self._topology: dict[int, list[int]] = {}

    def of(self, kind: str) -> list[int]:
        """Numbers of all entities of a kind, in the order of the file."""
        return self.numbered.get(kind, [])

    def label(self, number: int) -> str:
        """First text of an entity: its name."""
        return str(LABEL.findall(self.bodies[number])[0])[1:-1].replace("''", "'")

    def product(self, definition: int) -> str:
        """Name of what a product definition defines. ValueError: it is no product."""
        product = self.references(self.references(definition)[0])[0]
        if self.kinds[product] != "PRODUCT":
            raise ValueError(f"#{definition} defines no product")
        return self.label(product)

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

    def vertices(self, face: int) -> list[int]:
        """Numbers of the vertices of a face's edges, each at least once."""
        *bounds, _ = self.references(face)
        loops = [loop for bound in bounds for loop in self.references(bound)]
        return [vertex for loop in loops for vertex in self._of_loop(loop)]

    def _of_loop(self, loop: int) -> list[int]:
        inside = self.references(loop)
        if self.kinds[loop] == "VERTEX_LOOP":
            return inside
        edges = [edge for oriented in inside for edge in self.references(oriented)]
        return [vertex for edge in edges for vertex in self.references(edge)[:2]]

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


def _data_start(text: str) -> int:
    """Where the first entity begins."""
    start = START.match(text)
    for found in HEADER_END.finditer(text, start.end()) if start else ():
        if found["end"]:
            return found.end()
        if found["open"]:
            break
    raise ValueError("broken STEP text: no header and data section")
