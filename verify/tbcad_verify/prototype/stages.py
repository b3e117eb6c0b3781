"""The stages that look at the prototype. Each stands alone, as those of the shell do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.prototype import assembly, caps, leds, plan_checks, record_checks, seats, swing
from tbcad_verify.prototype.ball_views import BallViews, ball_views
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import (
    MeasuredPart,
    joined_meshes,
    measure_part,
    of_roles,
)
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype, measure_prototype
from tbcad_verify.prototype.seats import MeasuredSeats
from tbcad_verify.record.export import Export
from tbcad_verify.record.prototype import Prototype
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    attempt,
    finite,
    guarded,
    informative,
    require,
    short_list,
    worst_offenders,
)
from tbcad_verify.run.results import Results, ResultSink
from tbcad_verify.types import Floats

PRINTING = "printability of the prototype"
STAGES = (
    "prototype's record",
    "printed parts",
    "seats",
    "light by way of the balls",
    "swing",
    PRINTING,
)
LIGHT = {
    "cells": "directions",
    "coverage, balls": "mm",
    "coverage, balls, off the record": "mm",
    "light of the balls": "blocked rays",
    "rays of the balls": "rays",
    "pixels kept by the balls": "% of the shell's",
}
DIGITS = 9


def verify_prototype(
    export: Export, prototype: Prototype, facets: Sequence[Facets], sink: ResultSink
) -> list[MeasuredPart]:
    """Make all stages but printability, and hand over what each finds.

    Args:
        export: the record.
        prototype: its's.
        facets: of its parts, as read.
        sink: takes the results.

    Returns:
        The parts, measured.
    """
    context = PrototypeContext(export, prototype)
    sink(Results(stages=[STAGES[0]]))
    sink(Results(checks=record_checks.checks(context)))
    sink(Results(checks=plan_checks.checks(context)))
    sink(Results(stages=[STAGES[1]]))
    pairs = list(zip(prototype.parts, facets, strict=True))
    bodies = in_threads(lambda pair: measure_part(*pair), pairs)
    for one in bodies:
        masses = {} if one.placed_mass is None else {one.part.name: one.placed_mass}
        sink(Results(checks=one.checks, masses=masses))
    sink(Results(stages=[STAGES[2]]))
    held, measured = _seats(context, bodies, sink)
    sink(Results(stages=[STAGES[3]]))
    ready, reason = attempt(lambda: measure_prototype(context, _known(held), measured, bodies))
    shown, why = attempt(lambda: ball_views(require(ready, reason)))
    files = _files(bodies, "base", "cap", "stage", "frame")
    names = [(name, files, unit) for name, unit in LIGHT.items()]
    sink(
        Results(
            checks=guarded(names, lambda: _light(context, require(shown, reason or why), names))
        )
    )
    sink(Results(stages=[STAGES[4]]))
    _swing(context, ready, reason, bodies, sink)
    sink(Results(prototype=json_rows(context, held, shown)))
    return bodies


def _seats(
    context: PrototypeContext, bodies: list[MeasuredPart], sink: ResultSink
) -> tuple[MeasuredSeats | None, list[caps.MeasuredCap]]:
    files = _files(bodies, "base")
    base, reason = attempt(lambda: joined_meshes(of_roles(bodies, "base"))[0])
    held, why = attempt(lambda: seats.measure_seats(context, require(base, reason)))
    names = [(name, files, unit) for name, unit in seats.CHECKS.items()]
    sink(
        Results(
            checks=guarded(
                names, lambda: seats.checks(context, require(held, reason or why), files)
            )
        )
    )
    made = of_roles(bodies, "cap")
    if not context.prototype.balls.cap.any():
        return held, []
    found, odd = attempt(lambda: [caps.measure_cap(context, one) for one in made])
    files = _files(bodies, "cap")
    names = [(name, files, unit) for name, unit in caps.CHECKS.items()]
    sink(Results(checks=guarded(names, lambda: caps.checks(context, require(found, odd), files))))
    return held, found or []


def _swing(
    context: PrototypeContext,
    ready: MeasuredPrototype | None,
    reason: str,
    bodies: list[MeasuredPart],
    sink: ResultSink,
) -> None:
    files = _files(bodies, "base", "cap", "stage", "frame")
    names = [(name, files, unit) for name, unit in swing.CHECKS.items()]
    found, odd = attempt(lambda: assembly.assembly_meshes(context))
    bought, why = attempt(lambda: assembly.standing_solids(context, require(found, odd)))
    sink(
        Results(
            checks=guarded(
                names,
                lambda: swing.checks(require(ready, reason), bodies, require(bought, why), files),
            )
        )
    )
    whole = (assembly.CHECK[0], context.prototype.assembly.glb, assembly.CHECK[1])
    sink(
        Results(
            checks=guarded(
                [whole], lambda: [assembly.check(whole, context, bodies, require(found, odd))]
            )
        )
    )
    files = _files(bodies, "stage")
    names = [(name, files, unit) for name, unit in leds.CHECKS.items()]
    sink(Results(checks=guarded(names, lambda: leds.checks(context, bodies, files))))


def _light(context: PrototypeContext, found: BallViews, names: list[CheckName]) -> list[Check]:
    """Every mirror's ball shows all of the object at its stop, and nothing stands in between."""
    cells, covers, off, path, rays, kept = names
    ids = [context.export.mirrors.ids[k] for k in context.mine.tolist()]
    hidden, blocked = found.hidden.astype(float), found.blocked.astype(float)
    short = np.argsort(found.coverage, kind="stable")
    short = short[found.coverage[short] < context.export.target_mm]
    least = ball_coverage(context, found.coverage)
    balls = context.prototype.balls
    recorded = balls.coverage_mm if context.prototype.moved else balls.coverage_fixed_mm
    away = np.where(np.isfinite(least), np.abs(least - recorded), 0)
    furthest = int(away.argmax())
    return [
        at_most(cells, hidden.sum(), 0, f"another mirror covers {_some(ids, hidden)}"),
        at_least(
            covers,
            float(found.coverage.min()),
            context.export.target_mm,
            "shows too little: " + worst_offenders(ids, found.coverage, "mm", short),
        ),
        informative(off, float(away[furthest]), f"ball {furthest + 1} shows {least[furthest]:.3f}"),
        at_most(
            path,
            blocked.sum(),
            0,
            f"{_some(ids, blocked)}; blocked by {short_list(found.blockers)}",
        ),
        informative(rays, float(found.rays.sum()), "looked at, each on both of its ways"),
        informative(
            kept,
            100 * float(found.pixels.sum() / max(found.pixels_shell.sum(), 1)),
            f"{found.pixels.sum():.0f} of {found.pixels_shell.sum():.0f} px, from a sample",
        ),
    ]


def json_rows(
    context: PrototypeContext, held: MeasuredSeats | None, found: BallViews | None
) -> dict[str, Any]:
    """Ball by ball and stop by stop, as verify.json has it; what is not known is null."""
    balls = context.prototype.balls
    count = len(balls)
    blank = np.full(count, np.nan)
    error = blank if held is None else 1000 * norm(held.centre.T - balls.columns("bx", 3))
    least = pixels = shell = blank
    stops: list[dict[str, Any]] = []
    if found is not None:
        least = ball_coverage(context, found.coverage)
        pixels, shell = (
            np.bincount(context.ball, x, count) for x in (found.pixels, found.pixels_shell)
        )
        stops = _stops(context, found)
    return {
        "balls": [
            {
                "number": k + 1,
                "kind": "cap" if balls.cap[k] else "ball",
                "centre_error_um": _short(error[k]),
                "coverage_mm": _short(least[k]),
                "pixels": _short(round(pixels[k]) if np.isfinite(pixels[k]) else np.nan),
                "pixels_shell": _short(shell[k]),
            }
            for k in range(count)
        ],
        "stops": stops,
    }


def _stops(context: PrototypeContext, found: BallViews) -> list[dict[str, Any]]:
    stop = context.prototype.plan.stop[context.pictures]
    return [
        {
            "stop": number,
            "base_angle_deg": _short(np.degrees(context.angle[stop == number][0])),
            "mirrors": int((stop == number).sum()),
            "coverage_mm": _short(found.coverage[stop == number].min()),
            "blocked": int(found.blocked[stop == number].sum()),
        }
        for number in np.unique(stop).tolist()
    ]


def ball_coverage(context: PrototypeContext, coverage: Floats) -> Floats:
    """(K,) least coverage of the mirrors that each ball stands in for; inf: of none."""
    least = np.full(len(context.prototype.balls), np.inf)
    np.minimum.at(least, context.ball, coverage)
    return least


def _some(ids: list[str], counts: Floats) -> str:
    worst = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    return worst_offenders(ids, counts, "rays", worst, ".0f")


def _files(bodies: list[MeasuredPart], *roles: str) -> str:
    return ", ".join(one.part.stl for one in of_roles(bodies, *roles))


def _short(value: float) -> float | None:
    known = finite(float(value))
    return None if known is None else round(known, DIGITS)


def _known(held: MeasuredSeats | None) -> MeasuredSeats:
    return require(held, "the seats could not be measured")
