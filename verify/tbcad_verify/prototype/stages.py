"""The stages that verify the prototype. Each is independent, as those of the shell are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from types import ModuleType
from typing import Any, Generic, TypeVar

import numpy as np

from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.prototype import (
    assembly,
    bodies,
    bodies_apart,
    camera_gauge_checks,
    camera_mount_checks,
    caps,
    cut_checks,
    drive_checks,
    fastener_checks,
    holding_checks,
    key_access,
    seats,
    stage_checks,
    swing,
)
from tbcad_verify.prototype import record_checks as records
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control import homing_checks, klipper_checks
from tbcad_verify.prototype.light import ball_views, lamp_light
from tbcad_verify.prototype.light.ball_views import BallViews
from tbcad_verify.prototype.measured_parts import (
    MeasuredPart,
    joined_meshes,
    measure_part,
    of_roles,
)
from tbcad_verify.record.export import Export
from tbcad_verify.record.prototype import KLIPPER, SETTINGS, Prototype
from tbcad_verify.record.prototype import RECORD as RECORD_FILE
from tbcad_verify.report.checks import (
    Check,
    attempt,
    check_names,
    finite,
    guarded,
    require,
)
from tbcad_verify.run.results import Results, ResultSink
from tbcad_verify.step.shell_checks import RULE, rule_check
from tbcad_verify.step.solids_text import TextSolid

STAGES = (
    "prototype's record",
    "printed parts",
    "parts and fits",
    "seats",
    "light paths of the balls",
    "swing",
    "printability of the prototype",
)
RECORD, PARTS, FITS, SEATS, LIGHT, SWING, PRINTING = STAGES
PLACED = ("base", "cap", "stage", "frame")  # roles of the parts that are in the prototype
ZERO_DISC = "zero_disc"  # of the base, beside its carrier
PATTERNS = "shroud_*.dxf"
DRAWINGS = "drawing_*.dxf, plate_holes.csv"
DIGITS = 9

Row = dict[str, Any]
# Module with checks, or their units by name and what makes them.
Subject = ModuleType | tuple[Mapping[str, str], Callable[..., list[Check]]]
Files = str | tuple[str, ...]  # or roles of parts, whose STL files are named
# Subject, files, and arguments of the checks but names and context; what is worked out `Once` is.
Job = tuple[Any, ...]
T = TypeVar("T")


class Once(Generic[T]):
    """A value that is worked out when it is first asked for; why it is not known is kept too."""

    def __init__(self, work: Callable[[], T]) -> None:
        """Take what works the value out."""
        self.attempt = cache(lambda: attempt(work))

    def __call__(self) -> T:
        """The value. Unknown: it could not be worked out."""
        return require(*self.attempt())


class _Findings:
    """What several checks need."""

    def __init__(self, context: PrototypeContext, parts: list[MeasuredPart]) -> None:
        self.context, self.parts = context, parts
        base, caps_ = (of_roles(parts, role) for role in ("base", "cap"))
        self.drawn = Once(lambda: assembly.assembly_meshes(context))
        self.solids = Once(lambda: assembly.assembly_solids(context))
        self.own = Once(lambda: assembly.part_solids(context))
        self.seats = Once(lambda: seats.measure_seats(context, joined_meshes(base)[0]))
        self.caps = Once(lambda: [caps.measure_cap(context, part) for part in caps_])
        self.measured = Once(
            lambda: bodies.measure_prototype(
                context, self.seats(), self.caps(), parts, self.drawn()
            )
        )
        self.views = Once(lambda: _views(self.measured()))
        self.bodies = Once(lambda: bodies.AssembledBodies(context, self.drawn()))

    def own_of(self, role: str) -> list[TextSolid]:
        """Solids of the parts of a role."""
        some = [part for part in self.context.prototype.parts if part.role == role]
        return [self.own()[part.name] for part in some if part.name != ZERO_DISC]


def _views(measured: bodies.MeasuredPrototype) -> BallViews:
    return ball_views.ball_views(measured, ball_views.pixel_rays(measured))


def verify_prototype(
    export: Export, prototype: Prototype, facets: Sequence[Facets], sink: ResultSink
) -> list[MeasuredPart]:
    """Run all stages but printability; facets are those of the parts, as read.

    Returns:
        The parts, measured.
    """
    context = PrototypeContext(export, prototype)
    sink(Results(stages=[RECORD]))
    sink(Results(checks=records.checks(context)))
    if not export.parts:  # else the shell's STEP files bring this check
        sink(Results(checks=guarded([RULE], lambda: [rule_check(export)])))
    sink(Results(stages=[PARTS]))
    pairs = list(zip(prototype.parts, facets, strict=True))
    parts = in_threads(lambda pair: measure_part(*pair), pairs)
    for part in parts:
        masses = {} if part.placed_mass is None else {part.part.name: part.placed_mass}
        sink(Results(checks=part.checks, masses=masses))
    found = _Findings(context, parts)
    for stage, jobs in ((FITS, _fits), (SEATS, _seats), (LIGHT, _light), (SWING, _swing)):
        sink(Results(stages=[stage]))
        for job in jobs(found):
            sink(Results(checks=_done(found, *job)))
    sink(Results(prototype=json_rows(found)))
    return parts


def _done(found: _Findings, subject: Subject, files: Files, *arguments: object) -> list[Check]:
    """The checks of a job; all are unknown if they or their arguments break."""
    units, checks = subject if isinstance(subject, tuple) else (subject.CHECKS, subject.checks)
    if not isinstance(files, str):
        files = ", ".join(part.part.stl for part in of_roles(found.parts, *files))
    names = check_names(units, files)

    def work() -> list[Check]:
        values = [one() if isinstance(one, Once) else one for one in arguments]
        made: list[Check] = checks(names, found.context, *values)
        return made

    return guarded(names, work)


def _fits(found: _Findings) -> Iterator[Job]:
    """What there is, in all files that list it, and what follows from it."""
    solids, parts = found.solids, found.parts
    held = Once(lambda: found.own_of("base")), Once(lambda: found.own_of("cap"))
    yield assembly, RECORD_FILE, found.drawn, solids, found.own
    yield fastener_checks, RECORD_FILE, solids
    yield key_access, RECORD_FILE, found.drawn
    yield homing_checks, SETTINGS, solids
    yield cut_checks, DRAWINGS, solids
    yield klipper_checks, KLIPPER, solids
    yield holding_checks, RECORD_FILE, *held
    if found.context.prototype.balls.cap.any():
        yield (holding_checks.TILT, holding_checks.tilt_checks), RECORD_FILE, *held
    yield camera_mount_checks, RECORD_FILE, solids
    yield camera_gauge_checks, RECORD_FILE, parts
    yield drive_checks, RECORD_FILE, parts, solids


def _seats(found: _Findings) -> Iterator[Job]:
    yield seats, ("base",), found.seats
    if found.context.prototype.balls.cap.any():
        yield caps, ("cap",), found.caps


def _light(found: _Findings) -> Iterator[Job]:
    yield ball_views, PLACED, found.views


def _swing(found: _Findings) -> Iterator[Job]:
    context, parts, drawn = found.context, found.parts, found.drawn
    file, fixed = context.prototype.assembly.glb, ("stage", "frame")
    solids = Once(lambda: assembly.all_solids(parts, drawn()))
    yield swing, PLACED, found.measured, solids
    yield bodies_apart, file, solids, drawn
    yield (lamp_light.DARK, lamp_light.dark_checks), file, found.bodies
    yield (cut_checks.SHROUD, cut_checks.shroud_checks), PATTERNS, drawn, found.solids
    yield lamp_light, file, found.bodies, found.solids
    yield stage_checks, fixed, of_roles(parts, *fixed)


def json_rows(found: _Findings) -> Row:
    """Ball by ball and stop by stop, as verify.json has it; what is not known is null."""
    context, (held, _), (views, _) = found.context, found.seats.attempt(), found.views.attempt()
    balls = context.prototype.balls
    count = len(balls)
    error = minimum = pixels = shell = np.full(count, np.nan)
    if held is not None:
        error = seats.centre_errors(context, held)
    stops = []
    if views is not None:
        minimum = ball_views.ball_coverage(context, views.coverage)
        pixels = np.round(np.bincount(context.ball, views.pixels, count))
        shell = np.bincount(context.ball, views.pixels_shell, count)
        stop = context.prototype.plan.stop[context.plan_rows]
        stops = [
            {
                "stop": number,
                "base_angle_deg": _rounded(np.degrees(context.angle[stop == number][0])),
                "mirrors": int((stop == number).sum()),
                "coverage_mm": _rounded(views.coverage[stop == number].min()),
                "blocked": int(views.blocked[stop == number].sum()),
            }
            for number in np.unique(stop).tolist()
        ]
    rows = [
        {
            "number": k + 1,
            "kind": "cap" if balls.cap[k] else "ball",
            "centre_error_um": _rounded(error[k]),
            "coverage_mm": _rounded(minimum[k]),
            "pixels": _rounded(pixels[k]),
            "pixels_shell": _rounded(shell[k]),
        }
        for k in range(count)
    ]
    return {"balls": rows, "stops": stops}


def _rounded(value: float) -> float | None:
    known = finite(float(value))
    return None if known is None else round(known, DIGITS)
