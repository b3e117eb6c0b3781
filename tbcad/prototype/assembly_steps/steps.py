"""The steps of assembly: what each mounts, and which parts of the list it therefore takes.

A fastener belongs to the step that mounts the last body it goes through. What has no body (belt,
wire, glue) belongs to the step that names its kind. Steps thus take exactly the parts of the list.

The torque of a screw is K d F with K = 0.2 for dry steel (Shigley's Mechanical Engineering Design),
the force F by what yields first. Printed PETG creeps: heads press on it with less than half of its
yield (assumed 50 MPa), inserts shear it with less than a third of that in shear (50 MPa / sqrt 3).
Screws 8.8 bear 0.75 of their proof stress, 580 MPa (ISO 898-1).
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from typing import Any

import numpy as np

from tbcad.core.geometry.vectors import norm
from tbcad.errors import InputError
from tbcad.prototype.assembly_steps.machine import AssembledMachine, StepPlan
from tbcad.prototype.fasteners import core_radius
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.prototype.registry import PARTS
from tbcad.records.prototype import AssemblyStep, FastenerRecord

PLANS = tuple(step for part in PARTS for step in part.steps)
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
# Fits of what is not screwed, by kind.
FITS = {
    "inserts": "heat-set: press in with a soldering iron until flush",
    "dowels": "press by hand or in a vice",
    "magnets": "glue, with epoxy on the bottom and round the side",
    "leds": "push in; a drop of glue from behind",
    "tnuts": "slide into the slot",
    "bearings": "press by hand on the outer ring; ream the seat if it takes a hammer",
    "shafts": "slide, without force and without play",
    "collars": "its set screw hand tight",
    "spacers": "slide",
    "brakes": "by its own screws, on the motor",
    "belts": "lay round the wheel; it is pulled tight with the motor",
}
SCREWED = ("screws", "setscrews")
HOLDS = {"inserts": "insert", "nuts": "nut", "tnuts": "T-nut"}  # screws, by kind
SHAFTS = ("shaft", "motor")  # the first of them is locked in the hub


@dataclass(frozen=True)
class Use:
    """Parts that a step takes."""

    item: int  # number in the list of parts
    part: str  # its name there
    quantity: int  # that this step takes
    bodies: tuple[str, ...]  # of the assembly that they are; empty for what is not drawn


@dataclass(frozen=True)
class Step:
    """A step of assembly."""

    number: int  # from 1
    key: str  # name for files
    title: str  # of the step
    parts: tuple[Use, ...]  # that it takes
    does: tuple[str, ...]  # what is done, in this order
    fits: tuple[str, ...]  # torque or fit of each kind of joint
    checks: tuple[str, ...]  # what must be true afterwards
    near: tuple[str, ...]  # bodies, mounted before, that the parts are joined to


def assembly_steps(machine: AssembledMachine) -> tuple[Step, ...]:
    """All steps that a prototype needs, in order.

    InputError: a body or part belongs to no step, or the list has fewer than are mounted.
    """
    plans, mounting = mounting_steps(machine)
    parts = machine.bodies | {one.name: one.part for one in machine.fasteners}
    loose = _loose(plans, machine, parts)
    steps = []
    for number, plan in enumerate(plans, 1):
        here = [body for body, part in parts.items() if part and mounting[body] == plan.key]
        uses = _uses(machine, {body: parts[body] for body in here}, loose[plan.key])
        steps.append(_step(machine, number, plan, uses))
    return tuple(steps)


def mounting_steps(machine: AssembledMachine) -> tuple[list[StepPlan], dict[str, str]]:
    """The steps that a prototype needs, and which of them mounts each body and fastener.

    InputError: a body belongs to no step.
    """
    plans = [plan for plan in PLANS if plan.needed(machine)]
    bodies = {
        body: _first(body, (plan.key for plan in plans if plan.mounts(body)))
        for body in machine.bodies
    }
    mounted = {one.name: _latest(plans, bodies, machine, one) for one in machine.fasteners}
    return plans, bodies | mounted


def mounting_record(machine: AssembledMachine) -> tuple[AssemblyStep, ...]:
    """Bodies that each step mounts, for prototype.json."""
    plans, mounting = mounting_steps(machine)
    mounts: dict[str, list[str]] = {plan.key: [] for plan in plans}
    for body, key in mounting.items():
        mounts[key].append(body)
    return tuple(AssemblyStep(key=key, mounts=tuple(bodies)) for key, bodies in mounts.items())


def record(steps: Iterable[Step]) -> list[dict[str, Any]]:
    """The steps for other programs."""
    return [asdict(step) for step in steps]


def _first(what: str, keys: Iterator[str]) -> str:
    """The first step of those that take a body or part."""
    for key in keys:
        return key
    raise InputError(f"{what} is in no step of assembly: build again with this version of tbcad")


def _latest(
    plans: Sequence[StepPlan],
    bodies: dict[str, str],
    machine: AssembledMachine,
    fastener: FastenerRecord,
) -> str:
    """The last step that mounts a body that a fastener goes through, or what it holds.

    A screw in one piece of the carrier alone holds the shaft.
    """
    order, through = [plan.key for plan in plans], fastener.through
    steps = [bodies[body] for body in through if body in bodies]
    if not steps:
        raise InputError(f"{fastener.name} goes through no body: build again")
    alone = len(through) == 1 and through[0].startswith("carrier")
    if alone and machine.kind(fastener.part) in SCREWED:
        steps += [bodies[body] for body in SHAFTS if body in bodies][:1]
    return max(steps, key=order.index)


def _loose(
    plans: Sequence[StepPlan], machine: AssembledMachine, parts: dict[str, str]
) -> dict[str, Counter[str]]:
    """By step, how many of each part that no body is of."""
    drawn = Counter(part for part in parts.values() if machine.by_body(part))
    taken: dict[str, Counter[str]] = {plan.key: Counter() for plan in plans}
    for part, quantity in machine.bill.quantities.items():
        rest = quantity - drawn[part]
        if rest < 0:
            raise InputError(
                f"the list has {quantity} {part} for {drawn[part]} bodies: build again"
            )
        if rest:
            names = {part, machine.kind(part)}
            step = _first(part, (plan.key for plan in plans if names & {*plan.loose}))
            taken[step][part] = rest
    return taken


def _uses(machine: AssembledMachine, parts: dict[str, str], loose: Counter[str]) -> tuple[Use, ...]:
    """Parts that a step uses: those of its bodies, and loose ones."""
    here: dict[str, list[str]] = {part: [] for part in loose}
    for body, part in parts.items():
        here.setdefault(part, []).append(body)
    uses = []
    for part, bodies in here.items():
        if part not in machine.bill.items:
            raise InputError(f"{part} is mounted but not in the list of parts: build again")
        drawn = len(bodies) if machine.by_body(part) else 0
        uses.append(Use(machine.bill.items[part], part, drawn + loose[part], tuple(bodies)))
    return tuple(sorted(uses, key=lambda use: use.item))


def _step(machine: AssembledMachine, number: int, plan: StepPlan, uses: tuple[Use, ...]) -> Step:
    names = {body for use in uses for body in use.bodies}
    fasteners = [one for one in machine.fasteners if one.name in names]
    through = {body for one in fasteners for body in one.through}
    near = tuple(sorted((through | set(plan.near)) & set(machine.bodies) - names))
    does, checks, *more = plan.words(machine)
    fits = (*_torques(machine, fasteners), *_fits(machine, uses), *chain(*more))
    return Step(number, plan.key, plan.title, uses, tuple(does), fits, tuple(checks), near)


def _torques(machine: AssembledMachine, fasteners: Iterable[FastenerRecord]) -> list[str]:
    """A line for each kind of screw, torque, and what holds it."""
    screws = [one for one in fasteners if machine.kind(one.part) in SCREWED]
    counts = Counter((one.part, *tightening(machine, one)) for one in screws)
    return [
        f"{count} x {machine.ref(part)}: {torque}, in {held_by.replace('_', ' ')}"
        for (part, torque, held_by), count in counts.items()
    ]


def _fits(machine: AssembledMachine, uses: Iterable[Use]) -> list[str]:
    kinds: dict[str, list[str]] = {}
    for use in uses:
        if (kind := machine.kind(use.part)) in FITS:
            kinds.setdefault(kind, []).append(machine.ref(use.part))
    return [f"{', '.join(parts)}: {FITS[kind]}" for kind, parts in kinds.items()]


def tightening(machine: AssembledMachine, screw: FastenerRecord) -> tuple[str, str]:
    """How tight a screw or set screw is, as text, and what holds it."""
    part, last = machine.listed(screw.part), screw.through[-1]
    thread = part["thread_mm"] if part else 0.0
    on_axis = _kinds_on_axis(machine, screw, thread)
    in_hole = machine.is_printed(last) and not on_axis
    held_by = "the printed hole" if in_hole else f"thread of the {last}"
    if part and part.kind == "setscrews" and in_hole and not machine.is_printed(screw.through[0]):
        held_by = f"thread of the {screw.through[0]}"  # it presses on the last
    held_by = next((name for kind, name in HOLDS.items() if kind in on_axis), held_by)
    if part is None or thread < SMALLEST_THREAD_MM or thread == TRIPOD_MM or in_hole:
        return HAND, held_by
    force = min(_head_force(machine, screw, part), _thread_force(machine, thread, held_by))
    torque = NUT_FACTOR * thread / MM_PER_M * force
    return f"{max(STEP_NM * math.floor(torque / STEP_NM), STEP_NM):.3g} N m", held_by


def _kinds_on_axis(machine: AssembledMachine, screw: FastenerRecord, thread: float) -> set[str]:
    """Kinds of what has the screw's thread, is on its axis and in its last body alone."""
    mates = [one for one in machine.fasteners if one.through == (screw.through[-1],)]
    away = np.array([one.position_mm for one in mates]).reshape(-1, 3) - screw.position_mm
    along = np.array(screw.along)
    on_axis = norm(away - (away @ along)[:, None] * along) < ON_AXIS_MM
    parts = [machine.listed(one.part) for one, near in zip(mates, on_axis, strict=True) if near]
    return {one.kind for one in parts if one and one.kind in HOLDS and one["thread_mm"] == thread}


def _head_force(machine: AssembledMachine, screw: FastenerRecord, part: PurchasedPart) -> float:
    """Largest force on the plastic below the head, N; without limit below a head on metal."""
    if part.kind == "setscrews" or not machine.is_printed(screw.through[0]):
        return math.inf
    # Its washers are at its head, in the same direction.
    below = (
        machine.listed(one.part)
        for one in machine.fasteners
        if math.dist(one.position_mm, screw.position_mm) < NEAR_MM
        and math.dist(one.along, screw.along) < NEAR_MM / MM_PER_M
    )
    outer = [one["outer_mm"] for one in below if one and one.kind == "washers"]
    hole = part["thread_mm"] + HOLE_PLAY_MM
    return PRESSURE_MPA * math.pi / 4 * (max([part["head_mm"], *outer]) ** 2 - hole**2)


def _thread_force(machine: AssembledMachine, thread: float, held_by: str) -> float:
    """Largest force on the screw's core and on the plastic round an insert of its thread, N."""
    forces = [PROOF_SHARE * PROOF_MPA * math.pi * core_radius(thread) ** 2]
    for one in machine.fasteners if held_by == "insert" else ():
        part = machine.listed(one.part)
        if part and part.kind == "inserts" and part["thread_mm"] == thread:
            forces.append(SHEAR_MPA * math.pi * part["hole_mm"] * part["length_mm"])
    return min(forces)
