"""Flat drawings in DXF, read by group codes in plain Python: outlines, dimensions, words."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats

CUT = "cut"  # the layer of outlines and holes
X, Y, RADIUS, LAYER, TEXT, NAME, KIND, TURN = 10, 20, 40, 8, 1, 2, 70, 50  # group codes
DATUM, FIRST, SECOND, OPPOSITE = 10, 13, 14, 15  # codes of points of a dimension, x of each
LINEAR, DIAMETER, ORDINATE, KINDS, ALONG_X = 0, 3, 6, 7, 64  # types of dimensions, their bits
MOST_CIRCLES, MOST_DIMENSIONS = 1000, 1000
SAME_MM = 1e-6
NUMBER = re.compile(r"[0-9]+(?:\.[0-9]+)?")
MEASURED, DIAMETER_SIGN = "<>", "\u00d8"

Entity = dict[int, list[str]]
Pairs = list[tuple[int, str]]


@dataclass(frozen=True)
class Dimension:
    """A dimension as programs draw it anew, and the words of its picture.

    Attributes:
        form: of its text, with <> where the program writes what it measures.
        measured: between its points, mm; None where the kind is not known.
        shown: texts of its picture.
    """

    form: str
    measured: float | None
    shown: tuple[str, ...]

    def fault(self) -> str | None:
        """What is wrong with it."""
        if self.measured is None or len(self.shown) != 1:
            return "a dimension has no known kind, or not one text"
        (shown,) = self.shown
        numbers = _numbers(self.form, shown)
        if any(abs(float(one) - self.measured) <= _half_digit(one) + SAME_MM for one in numbers):
            return None
        return f"a dimension says {shown:.40} where {self.measured:.3f} mm are drawn"


@dataclass(frozen=True)
class FlatDrawing:
    """What a DXF says.

    Attributes:
        circles: (N, 3) x, y and radius of those to be cut, mm.
        corners: (M, 2) of the outlines to be cut.
        texts: all words, those in the pictures of dimensions too.
        dimensions: all of them.
    """

    circles: Floats
    corners: Floats
    texts: Counter[str]
    dimensions: tuple[Dimension, ...]

    def dimension_faults(self) -> Iterator[str]:
        """Dimensions that do not say what is measured; none at all is a fault too."""
        if not self.dimensions:
            yield "it has no dimension"
        yield from filter(None, (one.fault() for one in self.dimensions))


def read_dxf(text: str) -> FlatDrawing:
    """Circles and outlines on the layer to be cut, dimensions, and all texts.

    Raises:
        Unknown: it is no DXF, or has too many circles or dimensions.
    """
    entities = dxf_entities(text)
    cut = [one for one in entities if one.get(LAYER) == [CUT]]
    circles = [
        [float(one[code][0]) for code in (X, Y, RADIUS)] for one in cut if one[0] == ["CIRCLE"]
    ]
    if len(circles) > MOST_CIRCLES:
        raise Unknown(f"a drawing has {len(circles)} circles")
    corners = [
        [float(x), float(y)]
        for one in cut
        if one[0] == ["LWPOLYLINE"]
        for x, y in zip(one[X], one[Y], strict=True)
    ]
    dimensions = _dimensions(text, entities)
    texts = Counter(one[TEXT][0] for one in entities if one[0] == ["TEXT"])
    texts.update(word for one in dimensions for word in one.shown)
    return FlatDrawing(
        np.array(circles).reshape(-1, 3), np.array(corners).reshape(-1, 2), texts, dimensions
    )


def dxf_entities(text: str) -> list[Entity]:
    """Entities of a DXF, the values of each by group code.

    Raises:
        Unknown: it is no DXF.
    """
    return _grouped(_section(text, "ENTITIES"))


def _section(text: str, name: str) -> Pairs:
    """Group codes and values of a section."""
    lines = [line.strip() for line in text.splitlines()]
    try:
        codes = [int(line) for line in lines[::2]]
        pairs = list(zip(codes, lines[1::2], strict=True))
        begin = pairs.index((NAME, name))
        end = pairs.index((0, "ENDSEC"), begin)
    except ValueError:
        raise Unknown("a drawing is no DXF") from None
    return pairs[begin + 1 : end]


def _grouped(pairs: Pairs) -> list[Entity]:
    """What begins with each code 0."""
    found: list[Entity] = []
    for code, value in pairs:
        if code == 0:
            found.append({})
        if found:
            found[-1].setdefault(code, []).append(value)
    return found


def _dimensions(text: str, entities: Sequence[Entity]) -> tuple[Dimension, ...]:
    found = [one for one in entities if one[0] == ["DIMENSION"]]
    if len(found) > MOST_DIMENSIONS:
        raise Unknown(f"a drawing has {len(found)} dimensions")
    pictures = _words_of_blocks(text) if found else {}
    return tuple(
        Dimension(
            _form(one),
            _measured(one),
            tuple(word for name in one.get(NAME, [])[:1] for word in pictures.get(name, [])),
        )
        for one in found
    )


def _words_of_blocks(text: str) -> dict[str, list[str]]:
    """Texts of each block."""
    words: dict[str, list[str]] = {}
    name = ""
    for one in _grouped(_section(text, "BLOCKS")):
        if one[0] == ["BLOCK"]:
            name = one[NAME][0]
        elif one[0] == ["TEXT"]:
            words.setdefault(name, []).append(one[TEXT][0])
    return words


def _kind(one: Entity) -> int:
    return int(one.get(KIND, ["0"])[0])


def _form(one: Entity) -> str:
    """A dimension's text; programs write the sign of a diameter by themselves."""
    form = one.get(TEXT, [""])[0] or MEASURED
    sign = DIAMETER_SIGN if _kind(one) & KINDS == DIAMETER else ""
    return form.replace(MEASURED, sign + MEASURED)


def _measured(one: Entity) -> float | None:
    """What a program measures, mm, by the kind of dimension (DXF reference, DIMENSION)."""
    kind = _kind(one)
    if kind & KINDS == LINEAR:
        turn = math.radians(float(one.get(TURN, ["0"])[0]))
        way = _point(one, SECOND) - _point(one, FIRST)
        return abs(float(way @ [math.cos(turn), math.sin(turn)]))
    if kind & KINDS == DIAMETER:
        return float(np.hypot(*(_point(one, OPPOSITE) - _point(one, DATUM))))
    if kind & KINDS == ORDINATE:
        x, y = np.abs(_point(one, FIRST) - _point(one, DATUM)).tolist()
        return float(x if kind & ALONG_X else y)
    return None


def _point(one: Entity, code: int) -> Floats:
    """A point by the code of its x; not a number where it has none."""
    values = [float(one.get(of, ["nan"])[0]) for of in (code, code + 10)]
    return np.array(values, dtype=np.float64)


def _numbers(form: str, shown: str) -> list[str]:
    """The number that stands for what is measured, or else all numbers that are written."""
    if MEASURED not in form:
        return NUMBER.findall(shown) if form == shown else []
    before, _, after = form.partition(MEASURED)
    found = re.fullmatch(f"{re.escape(before)}({NUMBER.pattern}){re.escape(after)}", shown)
    return [found[1]] if found else []


def _half_digit(number: str) -> float:
    """Half of the last digit."""
    return 0.5 * 10.0 ** -len(number.partition(".")[2])
