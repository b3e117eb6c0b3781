"""The stages that verify the prototype. Each is independent, as those of the shell are.

`report/checks.toml` lists the modules of each stage. A module has `CHECKS`, the unit of each check
by name; `FILE`, what they are about: a file, or roles of parts, whose STL files are meant; and
`checks`, whose parameters after the names are those findings that it needs, by their names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import import_module
from inspect import signature
from typing import Any

from tbcad_verify.mesh.mesh import join_meshes
from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.prototype import record_checks
from tbcad_verify.prototype.assembly import (
    Shape,
    all_solids,
    assembly_meshes,
    assembly_solids,
    part_solids,
)
from tbcad_verify.prototype.bodies import AssembledBodies, MeasuredPrototype, measure_prototype
from tbcad_verify.prototype.caps import MeasuredCap, measure_cap
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.light.ball_views import BallViews, ball_views, pixel_rays
from tbcad_verify.prototype.measured_parts import MeasuredPart, measure_part, of_roles
from tbcad_verify.prototype.seats import MeasuredSeat, measure_seats
from tbcad_verify.record.export import Export
from tbcad_verify.record.prototype import Prototype
from tbcad_verify.report.checks import Check, attempt, check_names, guarded, require
from tbcad_verify.report.methods import prototype_stages
from tbcad_verify.run.results import Results, ResultSink
from tbcad_verify.step.recorded_checks import RULE, rule_check
from tbcad_verify.step.solids_text import TextSolid

RECORD, PARTS, PRINTING = "prototype's record", "printed parts", "printability of the prototype"
STAGES = (RECORD, PARTS, *prototype_stages(), PRINTING)
ZERO_DISC = "zero_disc"  # of the base, beside its carrier


@dataclass(frozen=True)
class Findings:
    """Shared by several checks: fields, and methods whose values are computed once."""

    context: PrototypeContext  # the record
    parts: list[MeasuredPart]  # all printed parts
    _known: dict[str, tuple[Any, str]] = field(default_factory=dict, init=False)

    def __getitem__(self, name: str) -> Any:
        """A finding by its name. Unknown: it could not be worked out."""
        if name not in self._known:
            value = getattr(self, name)
            self._known[name] = attempt(value) if callable(value) else (value, "")
        return require(*self._known[name])

    def drawn(self) -> dict[str, Shape]:
        """Shapes of the GLB's bodies, by name."""
        return assembly_meshes(self.context)

    def solids(self) -> dict[str, TextSolid]:
        """Solids of the STEP assembly, by name."""
        return assembly_solids(self.context)

    def own(self) -> dict[str, TextSolid]:
        """Solids of the parts' own STEP files, by name."""
        return part_solids(self.context)

    def carriers(self) -> list[TextSolid]:
        """Solids of the carrier's parts, of the zero disc beside it none."""
        return self._own_of("base", without=ZERO_DISC)

    def cap_solids(self) -> list[TextSolid]:
        """Solids of the caps, in the order of their balls."""
        return self._own_of("cap")

    def _own_of(self, role: str, without: str = "") -> list[TextSolid]:
        some = [part.name for part in self.context.prototype.parts if part.role == role]
        return [self["own"][name] for name in some if name != without]

    def closed(self) -> dict[str, Any]:
        """All bodies of the assembly as manifold3d has them, by name."""
        return all_solids(self.parts, self["drawn"])

    def seats(self) -> list[MeasuredSeat]:
        """Where the pads put the balls."""
        base = join_meshes([part.placed_mesh for part in of_roles(self.parts, "base")])
        return measure_seats(self.context, base)

    def caps(self) -> list[MeasuredCap]:
        """Spheres of the caps."""
        return [measure_cap(self.context, part) for part in of_roles(self.parts, "cap")]

    def measured(self) -> MeasuredPrototype:
        """Balls on their pads, and what may be in their light."""
        given = self["seats"], self["caps"], self.parts, self["drawn"]
        return measure_prototype(self.context, *given)

    def views(self) -> BallViews:
        """View by each mirror's ball."""
        return ball_views(self["measured"], pixel_rays(self["measured"]))

    def bodies(self) -> AssembledBodies:
        """The GLB's bodies, for rays."""
        return AssembledBodies(self.context, self["drawn"])


def verify_prototype(
    export: Export, prototype: Prototype, facets: Sequence[Facets], sink: ResultSink
) -> list[MeasuredPart]:
    """Run all stages but printability; facets are those of the parts, as read.

    Returns:
        The parts, measured.
    """
    context = PrototypeContext(export, prototype)
    sink(Results(stages=[RECORD]))
    sink(Results(checks=record_checks.checks(context)))
    if not export.parts:  # else the shell's STEP files bring this check
        sink(Results(checks=guarded([RULE], lambda: [rule_check(export)])))
    sink(Results(stages=[PARTS]))
    pairs = list(zip(prototype.parts, facets, strict=True))
    parts = in_threads(lambda pair: measure_part(*pair), pairs)
    for part in parts:
        masses = {} if part.placed_mass is None else {part.part.name: part.placed_mass}
        sink(Results(checks=part.checks, masses=masses))
    found = Findings(context, parts)
    for stage, modules in prototype_stages().items():
        sink(Results(stages=[stage]))
        for module in modules:
            sink(Results(checks=checks_of(module, found)))
    return parts


def checks_of(name: str, found: Findings) -> list[Check]:
    """The checks of a module, by its name; all are unknown if they or what they need break."""
    module = import_module(f"tbcad_verify.prototype.{name}")
    file = module.FILE
    if not isinstance(file, str):
        file = ", ".join(part.part.stl for part in of_roles(found.parts, *file))
    names = check_names(module.CHECKS, file)

    def work() -> list[Check]:
        needed = list(signature(module.checks).parameters)[1:]
        made: list[Check] = module.checks(names, *(found[one] for one in needed))
        return made

    return guarded(names, work)
