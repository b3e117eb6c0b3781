"""The steps of assembly: what each mounts, and which parts of the list it therefore takes.

A fastener belongs to the step that mounts the last body it goes through. What has no body (belt,
wire, glue) belongs to the step that names its kind. Steps thus take exactly the parts of the list.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from typing import Any

from tbcad.errors import InputError
from tbcad.prototype.assembly_steps.machine import Machine
from tbcad.prototype.assembly_steps.plans import PLANS, Plan
from tbcad.prototype.assembly_steps.tightening import tightening
from tbcad.records.prototype import AssemblyStep, FastenerRecord

# Fits of what is not screwed, by kind.
FITS = {
    "inserts": "heat-set: press in with a soldering iron until flush",
    "dowels": "press by hand or in a vice",
    "magnets": "glue, with epoxy on the bottom and round the side",
    "leds": "push in; a drop of glue from behind",
    "tnuts": "slide into the slot",
    "bearings": "press by hand on the outer ring; ream the seat if it takes a hammer",
    "shafts": "slide, without force and without play",
    "collars": "push against the bearing, then its set screw hand tight",
    "belts": "lay round the wheel; it is pulled tight with the motor",
}
SCREWED = ("screws", "setscrews")
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


def assembly_steps(machine: Machine) -> tuple[Step, ...]:
    """All steps that a prototype needs, in order.

    Raises:
        InputError: a body or part belongs to no step, or the list has fewer than are mounted.
    """
    plans, mounting = mounting_steps(machine)
    parts = machine.bodies | {one.name: one.part for one in machine.fasteners}
    loose = _loose(plans, machine, parts)
    return tuple(
        _step(machine, number, plan, _uses(machine, parts, mounting, plan, loose))
        for number, plan in enumerate(plans, 1)
    )


def mounting_steps(machine: Machine) -> tuple[list[Plan], dict[str, str]]:
    """The steps that a prototype needs, and which of them mounts each body and fastener.

    Raises:
        InputError: a body belongs to no step.
    """
    plans = [plan for plan in PLANS if plan.needed(machine)]
    bodies = {body: _plan_of(plans, body) for body in machine.bodies}
    mounted = {one.name: _latest(plans, bodies, machine, one) for one in machine.fasteners}
    return plans, bodies | mounted


def mounting_record(machine: Machine) -> tuple[AssemblyStep, ...]:
    """What each step mounts, for prototype.json."""
    plans, mounting = mounting_steps(machine)
    return tuple(
        AssemblyStep(
            key=plan.key, mounts=tuple(body for body, key in mounting.items() if key == plan.key)
        )
        for plan in plans
    )


def record(steps: Iterable[Step]) -> list[dict[str, Any]]:
    """The steps for other programs."""
    return [asdict(step) for step in steps]


def _plan_of(plans: Sequence[Plan], body: str) -> str:
    for plan in plans:
        if any(fnmatchcase(body, pattern) for pattern in plan.bodies):
            return plan.key
    raise InputError(f"{body} is in no step of assembly: build again with this version of tbcad")


def _latest(
    plans: Sequence[Plan], bodies: dict[str, str], machine: Machine, fastener: FastenerRecord
) -> str:
    """The last step that mounts a body that a fastener goes through, or what it holds."""
    order = [plan.key for plan in plans]
    steps = [bodies[body] for body in fastener.through if body in bodies]
    if not steps:
        raise InputError(f"{fastener.name} goes through no body: build again")
    if _locks_shaft(machine, fastener):
        steps += [bodies[body] for body in SHAFTS if body in bodies][:1]
    return max(steps, key=order.index)


def _locks_shaft(machine: Machine, fastener: FastenerRecord) -> bool:
    """Whether it is a screw in one piece of the carrier alone: it holds the shaft."""
    through = fastener.through
    alone = len(through) == 1 and through[0].startswith("carrier")
    return alone and machine.kind(fastener.part) in SCREWED


def _loose(
    plans: Sequence[Plan], machine: Machine, parts: dict[str, str]
) -> dict[str, Counter[str]]:
    """By step, how many of each part that no body is of."""
    drawn = Counter(part for part in parts.values() if machine.by_body(part))
    taken: dict[str, Counter[str]] = {plan.key: Counter() for plan in plans}
    for part, quantity in machine.quantities.items():
        rest = quantity - drawn[part]
        if rest < 0:
            raise InputError(
                f"the list has {quantity} {part} for {drawn[part]} bodies: build again"
            )
        if rest:
            taken[_plan_of_loose(plans, machine, part)][part] = rest
    return taken


def _plan_of_loose(plans: Sequence[Plan], machine: Machine, part: str) -> str:
    for plan in plans:
        if part in plan.loose or machine.kind(part) in plan.loose:
            return plan.key
    raise InputError(f"{part} is in no step of assembly: build again with this version of tbcad")


def _uses(
    machine: Machine,
    parts: dict[str, str],
    steps: dict[str, str],
    plan: Plan,
    loose: dict[str, Counter[str]],
) -> tuple[Use, ...]:
    here: dict[str, list[str]] = {part: [] for part in loose[plan.key]}
    for body, part in parts.items():
        if steps[body] == plan.key and part:
            here.setdefault(part, []).append(body)
    uses = []
    for part, bodies in here.items():
        if part not in machine.items:
            raise InputError(f"{part} is mounted but not in the list of parts: build again")
        drawn = len(bodies) if machine.by_body(part) else 0
        uses.append(Use(machine.items[part], part, drawn + loose[plan.key][part], tuple(bodies)))
    return tuple(sorted(uses, key=lambda use: use.item))


def _step(machine: Machine, number: int, plan: Plan, uses: tuple[Use, ...]) -> Step:
    names = {body for use in uses for body in use.bodies}
    fasteners = [one for one in machine.fasteners if one.name in names]
    through = {body for one in fasteners for body in one.through}
    near = tuple(sorted((through | set(plan.near)) & set(machine.bodies) - names))
    text = plan.text(machine)
    fits = (*_torques(machine, fasteners), *_fits(machine, uses), *text.fits)
    return Step(number, plan.key, plan.title, uses, text.does, fits, text.checks, near)


def _torques(machine: Machine, fasteners: Iterable[FastenerRecord]) -> list[str]:
    """A line for each kind of screw, torque, and what holds it."""
    screws = [one for one in fasteners if machine.kind(one.part) in SCREWED]
    counts = Counter((one.part, *tightening(machine, one)) for one in screws)
    return [
        f"{count} x {machine.ref(part)}: {torque}, in {held_by.replace('_', ' ')}"
        for (part, torque, held_by), count in counts.items()
    ]


def _fits(machine: Machine, uses: Iterable[Use]) -> list[str]:
    kinds: dict[str, list[str]] = {}
    for use in uses:
        if (kind := machine.kind(use.part)) in FITS:
            kinds.setdefault(kind, []).append(machine.ref(use.part))
    return [f"{', '.join(parts)}: {FITS[kind]}" for kind, parts in kinds.items()]
