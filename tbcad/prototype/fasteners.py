"""Small purchased parts in their places: screws, washers, nuts, inserts, dowels, magnets, LEDs.

What is bought is counted from these records, drawn from them, and verified against the holes.

Bodies are simplified as drawings do: no threads, no sockets. Threads are drawn at their core
diameter in screws, and at their nominal one in inserts and nuts, so that a screw in its place
shares no room with what it is screwed into.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from tbcad.core.geometry.primitives import (
    Component,
    Primitive,
    box,
    cylinder_between,
    rectangle,
    revolved_along,
)
from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.geometry.vectors import perpendicular_axes
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

# Pitch by nominal diameter: coarse threads of ISO 261; 1/4-20 UNC.
PITCH_MM = {2.0: 0.4, 3.0: 0.5, 4.0: 0.7, 5.0: 0.8, 6.0: 1.0, 6.35: 1.27}
CORE = 1.226869  # pitches by which the core of a screw is smaller than its thread (ISO 68-1)
WASHER_PLAY_MM = 0.3  # of a washer's hole (ISO 7089, M3 to M5)
# T-nuts; no list gives these.
TNUT_LENGTH_MM, TNUT_HEIGHT_MM, TNUT_DEPTH_MM, TNUT_PLAY_MM = 10.0, 4.0, 0.5, 0.4
THROUGH_MM = 1.0  # by which a hole extends beyond the part
FLANGE_MM = 1.0  # height of an LED's flange; no list gives it
DOME = np.radians([0.0, 30.0, 60.0, 90.0])  # corners of an LED's dome
UP = np.array([0.0, 0.0, 1.0])
LEVEL = 1e-9  # upward part of a direction that is level


@dataclass(frozen=True)
class Fastener:
    """A screw, set screw, washer, nut, insert, dowel, magnet or LED."""

    part: PurchasedPart  # from the lists
    # the point of its axis from which its body goes along, mm, (3,); of a screw and a washer it is
    # on the face that they press on
    place: Floats
    along: Floats  # unit vector in which it goes in, (3,)
    through: tuple[str, ...]  # names of the bodies that it goes through and into, in this order
    name: str = ""  # of its body, unique; empty until all are numbered
    rotates: bool = False  # whether it rotates with the base


def numbered(fasteners: Iterable[Fastener]) -> tuple[Fastener, ...]:
    """Fasteners named by their part and a number from 1, such as M5x12_3 or INSERT_M3_1."""
    counts: dict[str, int] = {}
    named = []
    for one in fasteners:
        number = counts[one.part.name] = counts.get(one.part.name, 0) + 1
        named.append(replace(one, name=re.sub(r"\W", "_", f"{one.part.name}_{number}")))
    return tuple(named)


def core_radius(thread: float) -> float:
    """Radius of a screw's core by its nominal diameter, mm."""
    return (thread - CORE * PITCH_MM[thread]) / 2


def fastener_component(fastener: Fastener) -> Component:
    """The body of a fastener in its place."""
    part, place, along = fastener.part, fastener.place, fastener.along
    removed: tuple[Primitive, ...] = ()
    if part.kind == "tnuts":
        added, removed = _tnut(part, place, along)
    else:
        added = (revolved_along(PROFILES[part.kind](part), place, along),)
    return Component(
        fastener.name, part.what, added, removed, part=part.name, rotates=fastener.rotates
    )


def fastener_axes(along: Floats) -> Floats:
    """Axes of a fastener along a direction, as rows; its own x is along it.

    What is along no upright direction keeps its z upright, as the slots of T-nuts are.
    """
    level = abs(along @ UP) < LEVEL
    across = np.cross(UP, along) if level else perpendicular_axes(along)[0]
    return np.stack([along, across, np.cross(along, across)])


def _rod(radius: float, length: float) -> Floats:
    return rectangle((0.0, 0.0), (length, radius))


def _screw(part: PurchasedPart) -> Floats:
    core, head, height = core_radius(part["thread_mm"]), part["head_mm"] / 2, part["head_height_mm"]
    end = part["length_mm"]
    return np.array(
        [[-height, 0.0], [end, 0.0], [end, core], [0.0, core], [0.0, head], [-height, head]]
    )


def _washer(part: PurchasedPart) -> Floats:
    hole = (part["thread_mm"] + WASHER_PLAY_MM) / 2
    return rectangle((-part["thickness_mm"], hole), (0.0, part["outer_mm"] / 2))


def _threaded(part: PurchasedPart, length: float, outer: float) -> Floats:
    return rectangle((0.0, part["thread_mm"] / 2), (length, outer / 2))


def _led(part: PurchasedPart) -> Floats:
    """Flange, body and dome; wires are not drawn."""
    flange, radius, height = part["flange_mm"] / 2, part["diameter_mm"] / 2, part["height_mm"]
    across, up = unit_circle(DOME).T
    dome = np.column_stack([height - radius + radius * up, radius * across])
    sides = [[0.0, 0.0], [height, 0.0], *dome[::-1].tolist()[1:], [FLANGE_MM, radius]]
    return np.array([*sides, [FLANGE_MM, flange], [0.0, flange]])


PROFILES: dict[str, Callable[[PurchasedPart], Floats]] = {
    "screws": _screw,
    "setscrews": lambda part: _rod(core_radius(part["thread_mm"]), part["length_mm"]),
    "washers": _washer,
    # Round, as wide as across its flats.
    "nuts": lambda part: _threaded(part, part["height_mm"], part["width_mm"]),
    "inserts": lambda part: _threaded(part, part["length_mm"], part["hole_mm"]),
    "dowels": lambda part: _rod(part["diameter_mm"] / 2, part["length_mm"]),
    "magnets": lambda part: _rod(part["diameter_mm"] / 2, part["height_mm"]),
    "leds": _led,
}
"""Sections (n, 2) by kind: (z along, r) from the fastener's place."""


def _tnut(
    part: PurchasedPart, place: Floats, along: Floats
) -> tuple[tuple[Primitive, ...], tuple[Primitive, ...]]:
    """A block in an upright slot, and its thread."""
    axes = np.stack([np.cross(UP, along), UP, along])
    half = np.array([(part["slot_mm"] - TNUT_PLAY_MM) / 2, TNUT_LENGTH_MM / 2, 0.0])
    start = axes @ place + [0.0, 0.0, TNUT_DEPTH_MM]
    block = box(start - half, start + half + [0.0, 0.0, TNUT_HEIGHT_MM], axes)
    end = place + (TNUT_DEPTH_MM + TNUT_HEIGHT_MM + THROUGH_MM) * along
    return (block,), (cylinder_between(place - THROUGH_MM * along, end, part["thread_mm"] / 2),)
