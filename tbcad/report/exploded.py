"""How far parts are drawn from their places, and numbers round a picture with leader lines."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tbcad.core.geometry.vectors import unit
from tbcad.prototype.assembly_steps.machine import AssembledMachine
from tbcad.records.prototype import FastenerRecord
from tbcad.types import Floats

BODY_MM = 22.0  # between bodies that a screw holds together
GAP_MM = 10.0  # between a fastener and what it goes into
FLAT_MM = 7.0  # washers and nuts from what they press on
BALL_MM = 33.0  # balls from their seats
LENGTHS = {"screws": "length_mm", "setscrews": "length_mm", "inserts": "length_mm"}
LENGTHS |= {"dowels": "length_mm", "magnets": "height_mm", "leds": "height_mm"}
# What no screw holds: along the base's axis (toward the camera), and up, mm.
ALONG_AXIS = {
    **{"bearing_front": 35.0, "bearing_rear": -35.0, "shaft": -70.0, "collar": -110.0},
    **{"spacer": 20.0, "brake": -30.0},
    **{"pinion": 45.0, "camera_gauge": 40.0},
}
UP = {"stage_crown": 40.0, "stage_disc": 70.0}
PANELS = {
    "shroud_lid": np.array([0.0, 0.0, 120.0]),
    "shroud_left": np.array([0.0, 150.0, 0.0]),
    "shroud_right": np.array([0.0, -150.0, 0.0]),
}


def offsets(machine: AssembledMachine, new: frozenset[str]) -> dict[str, Floats]:
    """By how much each new body of a step is moved, mm, (3,).

    Bodies are moved against the direction of the screws that hold them, and fasteners with them.
    """
    fasteners = [one for one in machine.fasteners if one.name in new]
    axis = np.array(machine.record.frame.axis)
    moved = {
        name: _own(machine, name, axis) + _by_screws(name, new, fasteners)
        for name in new
        if name in machine.bodies
    }
    return moved | {one.name: _fastener(machine, one, moved) for one in fasteners}


def _own(machine: AssembledMachine, name: str, axis: Floats) -> Floats:
    if name.startswith("ball_"):
        seat = machine.record.seats[int(name.removeprefix("ball_")) - 1]
        return np.asarray(-BALL_MM * np.array(seat.axis))
    if name.startswith("shroud_"):
        return PANELS.get(name, np.zeros(3))
    return np.asarray(ALONG_AXIS.get(name, 0.0) * axis + [0.0, 0.0, UP.get(name, 0.0)])


def _by_screws(name: str, new: frozenset[str], fasteners: Iterable[FastenerRecord]) -> Floats:
    """The sum over all directions of screws of how far a body is from the last one."""
    ways: dict[tuple[float, ...], int] = {}
    for one in fasteners:
        through = one.through
        if name not in through or len(through) == 1:
            continue
        way: tuple[float, ...] = tuple(round(float(part), 3) for part in one.along)
        if name != through[-1]:
            ways[way] = max(ways.get(way, 0), len(through) - 1 - through.index(name))
        elif through[0] not in new:
            ways[way] = -1
    total = np.zeros(3)
    for way, steps in ways.items():
        total -= BODY_MM * steps * unit(np.array(way))
    return total


def _fastener(machine: AssembledMachine, one: FastenerRecord, moved: dict[str, Floats]) -> Floats:
    """Out of the first body that it goes into, by its length and a gap."""
    part = machine.listed(one.part)
    size = LENGTHS.get(part.kind, "") if part else ""
    away = part[size] + GAP_MM if part and size else FLAT_MM
    if part and part.kind == "screws":
        away += FLAT_MM
    along = np.array(one.along, dtype=np.float64)
    return np.asarray(moved.get(one.through[0], np.zeros(3)) - away * along)


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
