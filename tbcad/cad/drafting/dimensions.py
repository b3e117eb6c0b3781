"""Dimensions, leaders, centre lines and labels on paper (ISO 129-1); all lengths in mm."""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from tbcad.cad.drafting.sheet import Box
from tbcad.cad.formats.entities import (
    Circle,
    Dimension,
    Layer,
    Line,
    Measured,
    Point,
    Polyline,
    Simple,
    Text,
)
from tbcad.cad.formats.pdf import text_width
from tbcad.types import Floats

TEXT_MM, ARROW_MM, ARROW_WIDTH_MM = 3.0, 3.0, 1.0
GAP_MM, BEYOND_MM = 1.0, 2.0  # of extension lines from the part, and beyond the dimension line
ABOVE_MM = 1.0  # of a text above its line
SHORT_MM = 3 * ARROW_MM  # a dimension that has no room for arrows between its ends
CROSS_MM = 2.0  # of centre lines beyond a circle
LABEL_MM = 2.5  # height of a label
LABEL_GAPS_MM = (1.0, 2.5, 4.0, 8.0)  # of a label from its hole, tried in turn
RULER_MM, JOG_MM = 3.6, 4.0  # from text to text of a ruler; of the oblique part of its lines
SIDES = ((1, 1), (-1, 1), (1, -1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
LEAST_MM = 1e-9  # lines across x or y are taken for as much oblique


def across(start: Point, end: Point, level: float, size: str, form: str = "<>") -> Dimension:
    """A horizontal dimension between two points, its line at a level; <> stands for the size."""
    return _length(start, end, ((start[0], level), (end[0], level)), 0.0, size, form)


def upward(start: Point, end: Point, level: float, size: str, form: str = "<>") -> Dimension:
    """A vertical dimension between two points, its line at a level; <> stands for the size."""
    return _length(start, end, ((level, start[1]), (level, end[1])), 90.0, size, form)


def _length(
    start: Point, end: Point, line: tuple[Point, Point], turn: float, size: str, form: str
) -> Dimension:
    feet = _extended(start, line[0]), _extended(end, line[1])
    measured = _measured(*line, form.replace("<>", size), turn)
    kind, layer, drawn = Measured.LENGTH, Layer.DIMENSIONS, (*feet, *measured)
    return Dimension(layer, kind, start, end, line[1], turn, size, form, drawn)


def _extended(point: Point, line: Point) -> Line:
    """An extension line from a point to a place of the dimension line, and beyond it."""
    x, y = (float(np.sign(b - a)) for a, b in zip(point, line, strict=True))
    foot = point[0] + x * GAP_MM, point[1] + y * GAP_MM
    return Line(Layer.DIMENSIONS, foot, (line[0] + x * BEYOND_MM, line[1] + y * BEYOND_MM))


def _measured(start: Point, end: Point, text: str, turn: float) -> Iterator[Simple]:
    above = ABOVE_MM
    yield Line(Layer.DIMENSIONS, start, end)
    if math.dist(start, end) < SHORT_MM:  # arrows from outside
        above += BEYOND_MM
        start, end = _beyond(start, end), _beyond(end, start)
        yield Line(Layer.DIMENSIONS, start, end)
        yield arrow(_beyond(start, end, -1), start)
        yield arrow(_beyond(end, start, -1), end)
    else:
        yield arrow(start, end)
        yield arrow(end, start)
    middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    up = math.radians(turn + 90)
    place = middle[0] + above * math.cos(up), middle[1] + above * math.sin(up)
    yield Text(Layer.DIMENSIONS, place, TEXT_MM, text, "centre", turn)


def _beyond(point: Point, other: Point, sign: int = 1) -> Point:
    """A place an arrow and a half beyond a point, seen from another; or as much before it."""
    share = sign * 1.5 * ARROW_MM / math.dist(point, other)
    (x, y), (from_x, from_y) = point, other
    return x + share * (x - from_x), y + share * (y - from_y)


def arrow(tip: Point, tail: Point) -> Polyline:
    """The head of an arrow from tail to tip."""
    length = math.dist(tip, tail)
    x, y = (tail[0] - tip[0]) / length, (tail[1] - tip[1]) / length
    half = ARROW_WIDTH_MM / 2
    foot = tip[0] + ARROW_MM * x, tip[1] + ARROW_MM * y
    sides = (foot[0] - half * y, foot[1] + half * x), (foot[0] + half * y, foot[1] - half * x)
    return Polyline(Layer.DIMENSIONS, (tip, *sides))


def leader(tip: Point, corner: Point, text: str) -> Iterator[Simple]:
    """An arrow to a point, from a corner that a text begins at, on the side away from the point."""
    yield Line(Layer.DIMENSIONS, tip, corner)
    yield arrow(tip, corner)
    width = text_width(text, TEXT_MM)
    left = corner[0] - (width if corner[0] < tip[0] else 0.0)
    yield Line(Layer.DIMENSIONS, (left, corner[1]), (left + width, corner[1]))
    yield Text(Layer.DIMENSIONS, (left, corner[1] + ABOVE_MM), TEXT_MM, text)


def diameter(circle: Circle, tip: Point, corner: Point, size: str, form: str) -> Dimension:
    """A circle's diameter, told at a leader to a point of it; <> stands for the size."""
    opposite = 2 * circle.centre[0] - tip[0], 2 * circle.centre[1] - tip[1]
    drawn = tuple(leader(tip, corner, form.replace("<>", size)))
    kind, layer = Measured.DIAMETER, Layer.DIMENSIONS
    return Dimension(layer, kind, opposite, tip, corner, 0.0, size, form, drawn)


def centre_cross(circle: Circle) -> Iterator[Simple]:
    """Centre lines of a circle."""
    (x, y), reach = circle.centre, circle.radius + CROSS_MM
    yield Line(Layer.CENTRE, (x - reach, y), (x + reach, y))
    yield Line(Layer.CENTRE, (x, y - reach), (x, y + reach))


def labels(
    circles: Sequence[Circle],
    texts: Iterable[str],
    lines: Sequence[tuple[Point, Point]] = (),
    taken: Sequence[Box] = (),
    height: float = LABEL_MM,
) -> Iterator[Simple]:
    """A label beside each circle on paper, clear of all circles and other texts if there is room.

    Nor does it lie on lines, given by their ends.
    """
    rims = ((circle.centre, circle.radius + CROSS_MM / 2) for circle in circles)
    boxes = [*((x - r, y - r, x + r, y + r) for (x, y), r in rims), *taken]
    ends = np.array(lines).reshape(-1, 2, 2)
    for circle, text in zip(circles, texts, strict=True):
        places = [*_beside(circle, text, height)]
        faults = [
            (any(_meet(one, other) for other in boxes), _crossings(one, ends)) for one in places
        ]
        box = places[faults.index(min(faults))]
        boxes.append(box)
        yield Text(Layer.DIMENSIONS, (box[0], box[1]), height, text)


def _crossings(box: Box, ends: Floats) -> int:
    """Number of lines, by their ends (n, 2, 2), that meet a box (slabs, after Kay and Kajiya)."""
    if not len(ends):
        return 0
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    step = np.where(np.abs(along) < LEAST_MM, LEAST_MM, along)
    near, far = (np.array(box[:2]) - start) / step, (np.array(box[2:]) - start) / step
    enter = np.minimum(near, far).max(axis=1)
    leave = np.maximum(near, far).min(axis=1)
    return int(np.sum((enter <= leave) & (leave >= 0) & (enter <= 1)))


def _beside(circle: Circle, text: str, height: float) -> Iterator[Box]:
    """Places of a label: at the corners, then at the sides, then farther away."""
    width = text_width(text, height)
    for gap in LABEL_GAPS_MM:
        for right, up in SIDES:
            reach = circle.radius + gap
            beside = {1: reach, 0: -width / 2, -1: -reach - width}
            above = {1: reach, 0: -height / 2, -1: -reach - height}
            left, low = circle.centre[0] + beside[right], circle.centre[1] + above[up]
            yield left, low, left + width, low + height


def _meet(one: Box, other: Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def ruler_across(
    levels: Sequence[tuple[float, str]], zero: float, edge: float, row: float
) -> Iterator[Dimension]:
    """Running dimensions below an edge (y): a turned text for each x on paper, in rows (ISO 129-1).

    Extension lines begin at the edge, texts go down from the row (y); zero is the datum's x on
    paper.
    """
    places = spread([x for x, _ in levels], RULER_MM)
    for (x, text), place in zip(levels, places, strict=True):
        way = (x, edge - GAP_MM), (x, row + JOG_MM), (place, row)
        low = row - GAP_MM - text_width(text, LABEL_MM)
        words = Text(Layer.DIMENSIONS, (place + LABEL_MM / 2, low), LABEL_MM, text, "left", 90.0)
        yield _running((zero, edge), (x, edge), 0.0, way, words)


def ruler_upward(
    levels: Sequence[tuple[float, str]], zero: float, edge: float, row: float
) -> Iterator[Dimension]:
    """Running dimensions left of an edge: a text for each y, in a column that ends at a row."""
    places = spread([y for y, _ in levels], RULER_MM)
    for (y, text), place in zip(levels, places, strict=True):
        way = (edge - GAP_MM, y), (row + JOG_MM, y), (row, place)
        at = row - GAP_MM, place - LABEL_MM / 2
        words = Text(Layer.DIMENSIONS, at, LABEL_MM, text, "right")
        yield _running((edge, zero), (edge, y), 90.0, way, words)


def _running(
    datum: Point, point: Point, turn: float, way: tuple[Point, ...], words: Text
) -> Dimension:
    """A running dimension; the minus of its text stands before what is measured."""
    size = words.text.removeprefix("-")
    form = words.text.removesuffix(size) + "<>"
    drawn = Polyline(Layer.DIMENSIONS, way, closed=False), words
    kind, layer = Measured.RUNNING, Layer.DIMENSIONS
    return Dimension(layer, kind, datum, point, way[-1], turn, size, form, drawn)


def spread(wanted: Sequence[float], gap: float) -> list[float]:
    """Rising places at least a gap apart, as near as can be to those wanted, which rise.

    The least sum of squares: neighbours that are too near share their mean (pool adjacent
    violators).
    """
    blocks: list[tuple[float, int]] = []  # mean of what remains without gaps, and how many
    for k, place in enumerate(wanted):
        block = (place - k * gap, 1)
        while blocks and blocks[-1][0] > block[0]:
            (mean, count), (other, more) = blocks.pop(), block
            block = ((mean * count + other * more) / (count + more), count + more)
        blocks.append(block)
    flat = [mean for mean, count in blocks for _ in range(count)]
    return [place + k * gap for k, place in enumerate(flat)]
