"""Numbers round a picture, with leader lines that do not cross."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tbcad.types import Floats

RADIUS, EDGE, FONT, SMALL = 25, 70, 26, 22
DOT, LINE, HALO = 5, 3, 7
INK, PAPER = "#111111", "#ffffff"


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


def draw_callouts(picture: Image.Image, placed: Sequence[Placed]) -> None:
    """Draw lines, dots, circles and numbers."""
    pen = ImageDraw.Draw(picture)
    for colour, width, dot in ((PAPER, HALO, DOT + 2), (INK, LINE, DOT)):
        for one in placed:
            pen.line([one.middle, one.callout.anchor], fill=colour, width=width)
            pen.circle(one.callout.anchor, dot, fill=colour)
    for one in placed:
        _number(pen, one, picture.width)


def _number(pen: ImageDraw.ImageDraw, one: Placed, width: int) -> None:
    x, y = one.middle
    pen.circle((x, y), RADIUS, fill=PAPER, outline=INK, width=LINE)
    pen.text((x, y), str(one.callout.number), INK, ImageFont.load_default(FONT), anchor="mm")
    if one.callout.quantity > 1:
        below = (x, y + RADIUS + 2)
        font = ImageFont.load_default(SMALL)
        pen.text(
            below, f"x {one.callout.quantity}", INK, font, "mt", stroke_width=3, stroke_fill=PAPER
        )


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
