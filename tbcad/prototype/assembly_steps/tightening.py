"""How tight screws are: as tight as what they press on and are held by permits.

The torque is K d F with K = 0.2 for dry steel (Shigley's Mechanical Engineering Design). The force
F is limited by what yields first. Printed PETG creeps, so heads press on it with at most 20 MPa,
less than half of its yield (assumed 50 MPa), and inserts shear it with at most 8 MPa, less than a
third of its yield in shear (50 MPa / sqrt 3). Screws 8.8 bear 0.75 of their proof stress, 580 MPa
(ISO 898-1).
"""

import math
from typing import NamedTuple

import numpy as np

from tbcad.core.geometry.vectors import norm
from tbcad.prototype.assembly_steps.machine import Machine
from tbcad.prototype.fasteners import core_radius
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.records.prototype import FastenerRecord

NUT_FACTOR = 0.2
PRESSURE_MPA, SHEAR_MPA, PROOF_MPA, PROOF_SHARE = 20.0, 8.0, 580.0, 0.75
HOLE_PLAY_MM = 0.5  # of a hole beyond its screw
ON_AXIS_MM = 0.5  # from a screw's axis to that of what it is screwed into
NEAR_MM = 3.0  # from a screw's head to its washer
MM_PER_M = 1000.0
STEP_NM = 0.05  # what can be set
HAND = "hand tight"
SMALLEST_THREAD_MM = 3.0  # smaller ones, and those in printed holes, are only hand tight
TRIPOD_MM = 6.35


class Tightening(NamedTuple):
    """Torque as text, and what the screw is held by."""

    torque: str
    held_by: str


def tightening(machine: Machine, screw: FastenerRecord) -> Tightening:
    """How tight a screw or set screw is, and what holds it."""
    part = machine.listed(screw.part)
    held_by = _held_by(machine, screw)
    if part is None or part["thread_mm"] < SMALLEST_THREAD_MM or part["thread_mm"] == TRIPOD_MM:
        return Tightening(HAND, held_by)
    if held_by == "the printed hole":
        return Tightening(HAND, held_by)
    force = min(_head_force(machine, screw, part), _thread_force(machine, screw, part, held_by))
    torque = NUT_FACTOR * part["thread_mm"] / MM_PER_M * force
    return Tightening(f"{max(STEP_NM * math.floor(torque / STEP_NM), STEP_NM):.2g} N m", held_by)


def _held_by(machine: Machine, screw: FastenerRecord) -> str:
    last, part = screw.through[-1], machine.listed(screw.part)
    thread = part["thread_mm"] if part else 0.0
    for kind, what in (("inserts", "insert"), ("nuts", "nut"), ("tnuts", "T-nut")):
        mates = (one for one in machine.fasteners if one.through == (last,))
        if any(_is_mate(machine, screw, one, kind, thread) for one in mates):
            return what
    return "the printed hole" if machine.is_printed(last) else f"thread of the {last}"


def _is_mate(
    machine: Machine, screw: FastenerRecord, one: FastenerRecord, kind: str, thread: float
) -> bool:
    """Whether an insert or nut of a thread is on a screw's axis."""
    part, along = machine.listed(one.part), np.array(screw.along)
    if part is None or part.kind != kind or part["thread_mm"] != thread:
        return False
    away = np.subtract(one.position_mm, screw.position_mm)
    return float(norm(away - (away @ along) * along)) < ON_AXIS_MM


def _head_force(machine: Machine, screw: FastenerRecord, part: PurchasedPart) -> float:
    """What the plastic below the head bears, N; without limit below a head on metal."""
    if part.kind == "setscrews" or not machine.is_printed(screw.through[0]):
        return math.inf
    washers = (machine.listed(one.part) for one in machine.fasteners if _is_below(one, screw))
    outer = [one["outer_mm"] for one in washers if one and one.kind == "washers"]
    hole = part["thread_mm"] + HOLE_PLAY_MM
    return PRESSURE_MPA * math.pi / 4 * (max([part["head_mm"], *outer]) ** 2 - hole**2)


def _is_below(one: FastenerRecord, screw: FastenerRecord) -> bool:
    """Whether a fastener is at a screw's head, in the same direction."""
    near = math.dist(one.position_mm, screw.position_mm) < NEAR_MM
    return near and math.dist(one.along, screw.along) < NEAR_MM / MM_PER_M


def _thread_force(
    machine: Machine, screw: FastenerRecord, part: PurchasedPart, held_by: str
) -> float:
    core = core_radius(part["thread_mm"])
    own = PROOF_SHARE * PROOF_MPA * math.pi * core**2
    if held_by != "insert":
        return own
    inserts = (machine.listed(one.part) for one in machine.fasteners)
    fitting = [
        one
        for one in inserts
        if one and one.kind == "inserts" and one["thread_mm"] == part["thread_mm"]
    ]
    return min(own, *(SHEAR_MPA * math.pi * one["hole_mm"] * one["length_mm"] for one in fitting))
