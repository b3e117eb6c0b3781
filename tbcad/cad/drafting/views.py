"""Views of a solid on a sheet, in first-angle projection (ISO 5456-2)."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tbcad.cad.drafting.sheet import placed
from tbcad.cad.formats.entities import (
    Arc,
    Circle,
    Entity,
    Layer,
    Line,
    Point,
    Polyline,
    simple,
)
from tbcad.cad.kernel.projection import FULL_DEG, Chain, Curve, Projection, Round, Segment
from tbcad.types import Floats

# Right, up and toward the eye in the part's frame: from in front, from above, from the left.
FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
ABOVE = np.eye(3)
LEFT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
CHAIN_DIGITS, CHORDS = 3, 17  # of mm, of points of curves; points that stand for an arc


def isometric() -> Floats:
    """Right, up and toward the eye of an isometric view from the front, left and above, (3, 3)."""
    eye = np.array([-1.0, -1.0, 1.0]) / np.sqrt(3)
    right = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    return np.stack([right, np.cross(eye, right), eye])


@dataclass(frozen=True)
class View:
    """A view and its place."""

    axes: Floats  # right, up and toward the eye in the part's frame, as rows, (3, 3)
    origin: Point  # of the part's coordinates on paper, mm
    scale: float  # of the view

    def at(self, point: Floats) -> Point:
        """Where a point of the part (mm, (3,)) is on paper, mm."""
        x, y = (self.scale * self.axes[:2] @ point).tolist()
        return self.origin[0] + x, self.origin[1] + y

    def drawn(self, projection: Projection) -> list[Entity]:
        """The edges on paper, the hidden ones below."""
        hidden = as_entities(projection.hidden, Layer.HIDDEN)
        flat = [*hidden, *as_entities(projection.visible, Layer.CUT)]
        return placed(flat, self.origin, self.scale)


def as_entities(curves: Iterable[Curve], layer: Layer) -> Iterator[Entity]:
    """Edges as entities of a layer, in mm of the part."""
    for curve in curves:
        match curve:
            case Segment(start, end):
                yield Line(layer, start, end)
            case Round(centre, radius, start_deg, end_deg) if end_deg - start_deg == FULL_DEG:
                yield Circle(layer, centre, radius)
            case Round(centre, radius, start_deg, end_deg):
                yield Arc(layer, centre, radius, start_deg, end_deg)
            case Chain(points):
                corners = tuple((round(x, CHAIN_DIGITS), round(y, CHAIN_DIGITS)) for x, y in points)
                yield Polyline(layer, corners, closed=False)


def straight(entities: Iterable[Entity]) -> list[tuple[Point, Point]]:
    """Straight pieces of what is drawn, by their ends: arcs as chords."""
    pieces: list[tuple[Point, Point]] = []
    for one in simple(entities):
        match one:
            case Line(_, start, end):
                pieces.append((start, end))
            case Polyline(_, corners):
                pieces += pairwise(corners)
            case Circle(_, centre, radius):
                pieces += pairwise(_on(centre, radius, 0.0, FULL_DEG))
            case Arc(_, centre, radius, first, last):
                pieces += pairwise(_on(centre, radius, first, first + (last - first) % FULL_DEG))
    return pieces


def _on(centre: Point, radius: float, first: float, last: float) -> list[Point]:
    """Points of an arc from one angle to another, degrees."""
    angles = np.radians(np.linspace(first, last, CHORDS))
    around = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * radius + centre
    return [(x, y) for x, y in around.tolist()]
