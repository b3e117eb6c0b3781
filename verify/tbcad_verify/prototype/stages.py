"""The stages that verify the prototype. Each is independent, as those of the shell are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from types import ModuleType
from typing import Any, Generic, TypeVar

import numpy as np

from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.prototype import (
    assembly,
    bodies,
    camera_gauge_checks,
    camera_mount_checks,
    drawing_checks,
    drive_checks,
    inventory,
    stage_checks,
    swing,
)
from tbcad_verify.prototype import record_checks as records
from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.control import homing_checks, klipper_checks, plan_checks
from tbcad_verify.prototype.fits import (
    cap_checks,
    caps,
    fastener_checks,
    holding_checks,
    key_access,
    seats,
)
from tbcad_verify.prototype.fits.seats import MeasuredSeat
from tbcad_verify.prototype.light import ball_views, darkness, lamp_light, shroud_checks
from tbcad_verify.prototype.light.ball_views import BallViews, ball_coverage
from tbcad_verify.prototype.measured_parts import (
    MeasuredPart,
    joined_meshes,
    measure_part,
    of_roles,
    stl_names,
)
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype, measure_prototype
from tbcad_verify.record.export import Export
from tbcad_verify.record.prototype import KLIPPER, SETTINGS, Prototype
from tbcad_verify.record.prototype import RECORD as RECORD_FILE
from tbcad_verify.report.checks import (
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
PATTERNS = "shroud_*.dxf"
DRAWINGS = "drawing_*.dxf, plate_holes.csv"
DIGITS = 9

Row = dict[str, Any]
T = TypeVar("T")


class Once(Generic[T]):
    """A value that is worked out when it is first asked for; why it is not known is kept too."""

    def __init__(self, work: Callable[[], T]) -> None:
        """Take what works the value out."""
        self._work = cache(lambda: attempt(work))

    def __call__(self) -> T:
        """The value.

        Raises:
            Unknown: it could not be worked out.
        """
        return require(*self._work())


def verify_prototype(
    export: Export, prototype: Prototype, facets: Sequence[Facets], sink: ResultSink
) -> list[MeasuredPart]:
    """Run all stages but printability.

    Args:
        export: the record.
        prototype: the record of its prototype.
        facets: of the parts, as read.
        sink: takes the results.

    Returns:
        The parts, measured.
    """
    context = PrototypeContext(export, prototype)
    sink(Results(stages=[RECORD]))
    sink(Results(checks=records.checks(context) + plan_checks.checks(context)))
    if not export.parts:  # else the shell's STEP files bring this check
        sink(Results(checks=guarded([RULE], lambda: [rule_check(export)])))
    sink(Results(stages=[PARTS]))
    pairs = list(zip(prototype.parts, facets, strict=True))
    parts = in_threads(lambda pair: measure_part(*pair), pairs)
    for part in parts:
        masses = {} if part.placed_mass is None else {part.part.name: part.placed_mass}
        sink(Results(checks=part.checks, masses=masses))
    drawn = Once(lambda: assembly.assembly_meshes(context))
    solids = Once(lambda: inventory.assembly_solids(context))
    sink(Results(stages=[FITS]))
    _fits(context, parts, sink, drawn, solids)
    sink(Results(stages=[SEATS]))
    held = Once(lambda: seats.measure_seats(context, joined_meshes(of_roles(parts, "base"))[0]))
    fitted = Once(lambda: [caps.measure_cap(context, part) for part in of_roles(parts, "cap")])
    base = stl_names(parts, "base")
    _add(sink, seats, base, lambda: (context, held()))
    if prototype.balls.cap.any():
        _add(sink, caps, stl_names(parts, "cap"), lambda: (context, fitted()))
    sink(Results(stages=[LIGHT]))
    measured = Once(lambda: measure_prototype(context, held(), fitted(), parts, drawn()))
    pixel = Once(lambda: ball_views.pixel_rays(measured()))
    views = Once(lambda: ball_views.ball_views(measured(), pixel()))
    _add(sink, ball_views, stl_names(parts, *PLACED), lambda: (context, views()))
    sink(Results(stages=[SWING]))
    _swing(context, parts, sink, measured, drawn, solids)
    sink(Results(prototype=json_rows(context, attempt(held)[0], attempt(views)[0])))
    return parts


def _add(
    sink: ResultSink, module: ModuleType, files: str, arguments: Callable[[], Sequence[object]]
) -> None:
    """Hand over a module's checks; all of them are unknown if they or their arguments break."""
    names = check_names(module.CHECKS, files)
    sink(Results(checks=guarded(names, lambda: module.checks(names, *arguments()))))


def _fits(
    context: PrototypeContext,
    parts: list[MeasuredPart],
    sink: ResultSink,
    drawn: Once[dict[str, Shape]],
    solids: Once[dict[str, TextSolid]],
) -> None:
    """What there is, in all files that list it, and what follows from it."""
    own = Once(lambda: inventory.part_solids(context))

    def held() -> Sequence[object]:
        return context, _carriers(context, own()), _of_role(context, "cap", own())

    _add(sink, inventory, RECORD_FILE, lambda: (context, drawn(), solids(), own()))
    _add(sink, fastener_checks, RECORD_FILE, lambda: (context, solids()))
    _add(sink, key_access, RECORD_FILE, lambda: (context, drawn()))
    _add(sink, homing_checks, SETTINGS, lambda: (context, solids()))
    _add(sink, drawing_checks, DRAWINGS, lambda: (context, solids()))
    _add(sink, klipper_checks, KLIPPER, lambda: (context, solids()))
    _add(sink, holding_checks, RECORD_FILE, held)
    if context.prototype.balls.cap.any():
        _add(sink, cap_checks, RECORD_FILE, held)
    _add(sink, camera_mount_checks, RECORD_FILE, lambda: (context, solids()))
    _add(sink, camera_gauge_checks, RECORD_FILE, lambda: (context, parts))
    _add(sink, drive_checks, RECORD_FILE, lambda: (context, parts, solids()))


def _carriers(context: PrototypeContext, solids: dict[str, TextSolid]) -> list[TextSolid]:
    return [
        solids[part.name]
        for part in context.prototype.parts
        if part.role == "base" and part.name != inventory.ZERO_DISC
    ]


def _of_role(context: PrototypeContext, role: str, solids: dict[str, TextSolid]) -> list[TextSolid]:
    return [solids[part.name] for part in context.prototype.parts if part.role == role]


def _swing(
    context: PrototypeContext,
    parts: list[MeasuredPart],
    sink: ResultSink,
    measured: Once[MeasuredPrototype],
    drawn: Once[dict[str, Shape]],
    solids: Once[dict[str, TextSolid]],
) -> None:
    still = Once(lambda: assembly.fixed_solids(context, drawn()))
    turning = Once(lambda: assembly.fastener_solids(context, drawn(), turns=True))
    assembled = Once(lambda: bodies.AssembledBodies(context, drawn()))
    files, file = stl_names(parts, *PLACED), context.prototype.assembly.glb
    static = of_roles(parts, "stage", "frame")
    _add(sink, swing, files, lambda: (measured(), parts, still(), turning()))
    _add(sink, assembly, file, lambda: (context, parts, drawn()))
    _add(sink, darkness, file, lambda: (context, assembled().without(bodies.OWN)))
    _add(sink, shroud_checks, PATTERNS, lambda: (context, drawn(), solids()))
    _add(sink, lamp_light, file, lambda: (context, assembled(), solids()))
    _add(sink, stage_checks, stl_names(static, "stage", "frame"), lambda: (context, static))


def json_rows(
    context: PrototypeContext, seats_measured: list[MeasuredSeat] | None, views: BallViews | None
) -> Row:
    """Ball by ball and stop by stop, as verify.json has it; what is not known is null."""
    balls = context.prototype.balls
    count = len(balls)
    error = minimum = pixels = shell = np.full(count, np.nan)
    if seats_measured is not None:
        error = seats.centre_errors(context, seats_measured)
    if views is not None:
        minimum = ball_coverage(context, views.coverage)
        pixels = np.round(np.bincount(context.ball, views.pixels, count))
        shell = np.bincount(context.ball, views.pixels_shell, count)
    return {
        "balls": [
            {
                "number": k + 1,
                "kind": "cap" if balls.cap[k] else "ball",
                "centre_error_um": _rounded(error[k]),
                "coverage_mm": _rounded(minimum[k]),
                "pixels": _rounded(pixels[k]),
                "pixels_shell": _rounded(shell[k]),
            }
            for k in range(count)
        ],
        "stops": [] if views is None else _stop_rows(context, views),
    }


def _stop_rows(context: PrototypeContext, views: BallViews) -> list[Row]:
    stop = context.prototype.plan.stop[context.plan_rows]
    return [
        {
            "stop": number,
            "base_angle_deg": _rounded(np.degrees(context.angle[stop == number][0])),
            "mirrors": int((stop == number).sum()),
            "coverage_mm": _rounded(views.coverage[stop == number].min()),
            "blocked": int(views.blocked[stop == number].sum()),
        }
        for number in np.unique(stop).tolist()
    ]


def _rounded(value: float) -> float | None:
    known = finite(float(value))
    return None if known is None else round(known, DIGITS)
