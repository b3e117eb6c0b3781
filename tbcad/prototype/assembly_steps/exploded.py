"""How far parts are drawn from their places in the pictures of the steps."""

from collections.abc import Iterable

import numpy as np

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
