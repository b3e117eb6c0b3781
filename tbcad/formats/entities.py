"""Flat drawings as data: lines, circles, arcs, polylines and texts on named layers, in mm.

x is to the right and y up. The same entities are written as DXF and as PDF.
"""

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
    """A line of text.

    Attributes:
        layer: of it.
        place: on the base line: its beginning, middle or end, as align says.
        height: of capital letters.
        text: what it says.
        align: of the text to its place.
        turn_deg: counterclockwise from the x axis.
    """

    layer: Layer
    place: Point
    height: float
    text: str
    align: Align = "left"
    turn_deg: float = 0.0


Entity: TypeAlias = Line | Circle | Arc | Polyline | Text
"""Whatever a drawing consists of."""
