"""Flat drawings as data: lines, circles, arcs, polylines and texts on named layers, in mm.

x is to the right and y up. The same entities are written as DXF and as PDF.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias

Point: TypeAlias = tuple[float, float]
Align: TypeAlias = Literal["left", "centre", "right"]


class Layer(StrEnum):
    """What an entity is for; a cutter takes some layers and leaves the others out."""

    CUT = "cut"  # outlines, visible edges and holes
    FOLD = "fold"  # where card is scored and folded
    ENGRAVE = "engrave"  # marks and numbers that are wanted on the part
    HIDDEN = "hidden"  # edges behind the part
    HATCH = "hatch"  # where a section cuts material
    RAYS = "rays"  # rays of light
    CENTRE = "centre"  # centre lines
    DIMENSIONS = "dimensions"  # dimensions, their texts, notes
    FRAME = "frame"  # border and title block


@dataclass(frozen=True)
class Line:
    """A straight line between two points."""

    layer: Layer
    start: Point
    end: Point


@dataclass(frozen=True)
class Circle:
    """A circle by its centre and radius."""

    layer: Layer
    centre: Point
    radius: float


@dataclass(frozen=True)
class Arc:
    """An arc counterclockwise between two angles from the x axis, in degrees."""

    layer: Layer
    centre: Point
    radius: float
    start_deg: float
    end_deg: float


@dataclass(frozen=True)
class Polyline:
    """Straight lines from corner to corner, and back to the first one where closed."""

    layer: Layer
    corners: tuple[Point, ...]
    closed: bool = True


@dataclass(frozen=True)
class Text:
    """A line of text."""

    layer: Layer  # of it
    place: Point  # on the base line: its beginning, middle or end, as align says
    height: float  # of capital letters
    text: str  # what it says
    align: Align = "left"  # of the text to its place
    turn_deg: float = 0.0  # counterclockwise from the x axis


Simple: TypeAlias = Line | Circle | Arc | Polyline | Text  # what is drawn as it is


class Measured(StrEnum):
    """What a dimension measures."""

    LENGTH = "length"  # from start to end, along a direction
    RUNNING = "running"  # from a datum, along x or y
    DIAMETER = "diameter"  # from a point of a circle to the one opposite


@dataclass(frozen=True)
class Dimension:
    """A dimension: what it measures, and how it is drawn."""

    layer: Layer  # of it
    kind: Measured  # of it
    start: Point  # of what is measured, or the datum
    end: Point  # of what is measured
    line: Point  # where the dimension line ends; of a diameter the end of its leader
    turn_deg: float  # direction that is measured along, from the x axis: 0 or 90
    size: str  # the number that is written
    form: str  # of the text, with <> for the number
    drawn: tuple[Simple, ...]  # lines, arrows and text

    @property
    def measured(self) -> float:
        """What a ruler on the drawing would show, mm."""
        x, y = self.end[0] - self.start[0], self.end[1] - self.start[1]
        if self.kind is Measured.DIAMETER:
            return math.hypot(x, y)
        turn = math.radians(self.turn_deg)
        return abs(x * math.cos(turn) + y * math.sin(turn))


Entity: TypeAlias = Simple | Dimension  # whatever a drawing consists of


def simple(entities: Iterable[Entity]) -> Iterator[Simple]:
    """All that is drawn: of dimensions their lines, arrows and texts."""
    for entity in entities:
        if isinstance(entity, Dimension):
            yield from entity.drawn
        else:
            yield entity
