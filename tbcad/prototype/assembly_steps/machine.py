"""A prototype as its build describes it: bodies, fasteners, list of parts; steps as planned."""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias

from tbcad.common.told import told
from tbcad.prototype.files.bom import PartsList, read_parts_list
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, load_parts
from tbcad.records.prototype import NAME, FastenerRecord, Prototype
from tbcad.records.tables import BallRow, WiringRow

UNIT_PARTS = ("strips", "sheets")  # kinds that are counted by the metre or sheet, not by bodies
RESISTORS, OWN = "resistors", "own"


@dataclass(frozen=True)
class AssembledMachine:
    """The parts of a prototype."""

    bill: PartsList  # its list of parts
    record: Prototype  # prototype.json
    wiring: tuple[WiringRow, ...]  # lines of the controller
    # diameter text of each purchased ball by its number, as in the list of parts
    sizes: dict[int, str]
    parts: Parts  # tbcad's lists of purchased parts

    @cached_property
    def bodies(self) -> dict[str, str]:
        """Part of each body that is no fastener; empty for what the list does not have."""
        printed = {one.name: one.listed_name for one in self.record.parts}
        bought = {one.name: one.part or "" for one in self.record.bought}
        balls = {f"ball_{number}": f"ball {size}" for number, size in self.sizes.items()}
        shroud = self.record.shroud
        panels = {one.name: shroud.sheet for one in shroud.panels} if shroud else {}
        return {**printed, **bought, **balls, **panels}

    @property
    def fasteners(self) -> tuple[FastenerRecord, ...]:
        """Screws, inserts, magnets and the like."""
        return self.record.fasteners

    def has(self, body: str) -> bool:
        """Whether there is such a body."""
        return body in self.bodies

    def is_printed(self, body: str) -> bool:
        """Whether a body is made of plastic."""
        return any(one.name == body for one in self.record.parts)

    def listed(self, part: str) -> PurchasedPart | None:
        """A part of tbcad's lists; None of others, such as balls and printed ones."""
        return self.parts.get(part)

    def kind(self, part: str) -> str:
        """The list that a part is in, such as screws; own where it is in none."""
        if any(row.resistor == part for row in self.wiring):
            return RESISTORS
        found = self.parts.get(part)
        return found.kind if found else OWN

    def by_body(self, part: str) -> bool:
        """Whether each body of a part is one of its pieces in the list."""
        return bool(part) and self.kind(part) not in UNIT_PARTS

    def ref(self, part: str) -> str:
        """A part with its number in the list, for a text."""
        return f"{part} ({self.bill.items[part]})" if part in self.bill.items else part

    def body_ref(self, body: str) -> str:
        """A body's part with its number in the list."""
        return self.ref(self.bodies[body])


def read_machine(folder: Path) -> AssembledMachine:
    """The prototype of a build.

    InputError: a file is missing or broken, or was written by an earlier version.
    """
    bill, record = read_parts_list(folder), Prototype.read(folder / NAME)
    wiring = tuple(WiringRow.read(folder))
    sizes = {ball.number: ball.size for ball in BallRow.read(folder) if ball.kind == "ball"}
    return AssembledMachine(bill, record, wiring, sizes, load_parts())


Values: TypeAlias = dict[str, object]
"""What the words of a step have in their places, and what decides which of them are told."""


@dataclass(frozen=True)
class StepPlan:
    """A step as it is planned for all designs."""

    title: str  # of the step
    values: Callable[[AssembledMachine], Values]  # of its words for a prototype; named by the step
    bodies: tuple[str, ...]  # patterns of names of the bodies that it mounts
    loose: tuple[str, ...]  # parts, or kinds of them, without bodies that it takes
    near: tuple[str, ...]  # bodies that the picture shows, too

    @property
    def key(self) -> str:
        """Name of the step for files."""
        return self.values.__name__.removesuffix("_step")

    def words(self, machine: AssembledMachine) -> tuple[list[str], ...]:
        """Actions, checks afterwards, and fits, from the TOML file beside the step's module."""
        values = self.values(machine)
        kinds = _texts(self.values.__module__)[self.key].values()
        return tuple([text for _, text in told(lines, values)] for lines in kinds)

    def needed(self, machine: AssembledMachine) -> bool:
        """Whether a prototype has any of its bodies; a step of none is always needed."""
        return not self.bodies or any(map(self.mounts, machine.bodies))

    def mounts(self, body: str) -> bool:
        """Whether it mounts a body."""
        return any(fnmatchcase(body, pattern) for pattern in self.bodies)


def planned(
    title: str, *bodies: str, loose: tuple[str, ...] = (), near: tuple[str, ...] = ()
) -> Callable[[Callable[[AssembledMachine], Values]], StepPlan]:
    """Plan a step whose words have the values that a function gives."""
    return lambda values: StepPlan(title, values, bodies, loose, near)


@cache
def _texts(module: str) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Lines of a module's steps by step, then does, checks and fits."""
    package, _, name = module.rpartition(".")
    table = tomllib.loads((files(package) / f"{name}.toml").read_text(encoding="utf-8"))
    return {
        step: {
            kind: [{"text": one} if isinstance(one, str) else one for one in lines]
            for kind, lines in kinds.items()
        }
        for step, kinds in table.items()
    }


def when(condition: object, text: str) -> str:
    """A text that is told under a condition."""
    return text if condition else ""
