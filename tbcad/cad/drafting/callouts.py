"""Numbers round a picture with leader lines that do not cross."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tbcad.cad.drafting.sheet import Box
from tbcad.cad.formats.entities import Circle, Entity, Layer, Line, Point, Text
from tbcad.types import Floats

RADIUS, EDGE, SMALL = 25, 70, 22
BALLOON_MM, TEXT_MM, DOT_MM = 2.8, 2.5, 0.5
PIXELS = RADIUS / BALLOON_MM  # of the call-outs' own unit, 1/mm


class Callout(NamedTuple):
    """A number, how many there are, and the point (x, y) of the picture that it is of, pixels."""

    number: int
    quantity: int
    anchor: tuple[float, float]


class Placed(NamedTuple):
    """A call-out and the middle of its circle (x, y), pixels."""

    callout: Callout
    middle: tuple[float, float]


def place_callouts(callouts: Sequence[Callout], size: tuple[int, int]) -> list[Placed]:
    """Middles of circles at both sides of a picture, so that no two lines cross.

    Those of the left half of the anchors are at the left side, by height; the others at the right.
    """
    by_x = sorted(callouts, key=lambda one: (one.anchor[0], one.number))
    half = (len(by_x) + 1) // 2
    left, right = by_x[:half], by_x[half:]
    return [*_column(left, EDGE, size[1]), *_column(right, size[0] - EDGE, size[1])]


def _column(callouts: Sequence[Callout], x: float, height: int) -> list[Placed]:
    """Call-outs one above the other, as near to their anchors' heights as there is room."""
    ordered = sorted(callouts, key=lambda one: (one.anchor[1], one.number))
    heights = _spread(np.array([one.anchor[1] for one in ordered]), height)
    _uncross(ordered, x, heights)
    return [Placed(one, (x, y)) for one, y in zip(ordered, heights.tolist(), strict=True)]


def _spread(wanted: Floats, height: int) -> Floats:
    """Heights that keep their order and a distance, from top to bottom."""
    count = len(wanted)
    gap = min(2.0 * RADIUS + SMALL + 12, (height - 2.0 * EDGE) / max(count - 1, 1))
    steps, low, high = gap * np.arange(count), float(EDGE), height - EDGE - gap * (count - 1)
    return np.asarray(np.clip(np.maximum.accumulate(wanted - steps), low, max(low, high)) + steps)


def _uncross(ordered: list[Callout], x: float, heights: Floats) -> None:
    """Exchange call-outs whose lines cross; each exchange makes the lines shorter in all."""
    crossing = True
    while crossing:
        crossing = False
        for i in range(len(ordered) - 1):
            for j in range(i + 1, len(ordered)):
                a, b = (x, float(heights[i])), (x, float(heights[j]))
                if cross(a, ordered[i].anchor, b, ordered[j].anchor):
                    ordered[i], ordered[j] = ordered[j], ordered[i]
                    crossing = True


def cross(
    a: tuple[float, float],
    b: tuple[float, float],
    c: tuple[float, float],
    d: tuple[float, float],
) -> bool:
    """Whether the lines from a to b and from c to d have an inner point in common."""
    return _side(a, b, c) * _side(a, b, d) < 0 and _side(c, d, a) * _side(c, d, b) < 0


def _side(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return float(np.sign((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])))


def balloons(points: Iterable[tuple[int, Point]], room: Box) -> Iterator[Entity]:
    """Circles with numbers at both sides of a room on paper, and lines to the points, mm."""
    left, low, right, high = room
    size = round((right - left) * PIXELS), round((high - low) * PIXELS)
    callouts = [
        Callout(number, 1, ((x - left) * PIXELS, (high - y) * PIXELS)) for number, (x, y) in points
    ]
    for callout, place in place_callouts(callouts, size):
        x, y = left + place[0] / PIXELS, high - place[1] / PIXELS
        tip = left + callout.anchor[0] / PIXELS, high - callout.anchor[1] / PIXELS
        way = np.array([tip[0] - x, tip[1] - y])
        start = np.array([x, y]) + BALLOON_MM * way / max(float(np.hypot(*way)), BALLOON_MM)
        yield Line(Layer.DIMENSIONS, (float(start[0]), float(start[1])), tip)
        yield Circle(Layer.DIMENSIONS, tip, DOT_MM)
        yield Circle(Layer.DIMENSIONS, (x, y), BALLOON_MM)
        yield Text(Layer.DIMENSIONS, (x, y - TEXT_MM / 2), TEXT_MM, str(callout.number), "centre")
