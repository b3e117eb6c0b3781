"""The stages that look at the prototype. Each stands alone, as those of the shell do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.prototype import assembly, caps, leds, places, plan, seats, swing
from tbcad_verify.prototype.bodies import Body, body, joined_bodies, of_roles
from tbcad_verify.prototype.rig import Rig, rig
from tbcad_verify.prototype.seats import Held
from tbcad_verify.prototype.tracing import Shown, show
from tbcad_verify.prototype.view import View
from tbcad_verify.record.prototype_record import Prototype
from tbcad_verify.record.record import Export
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
from tbcad_verify.run.results import ResultSink
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


def prove(
    export: Export, made: Prototype, facets: Sequence[Facets], taker: ResultSink
) -> list[Body]:
    """Make all stages but printability, and hand over what each finds.

    Args:
        export: the record.
        made: the prototype's.
        facets: of its parts, as read.
        taker: of stages, checks and figures.

    Returns:
        The parts, measured.
    """
    view = View(export, made)
    taker.stage(STAGES[0])
    taker.checks(places.checks(view))
    taker.checks(plan.checks(view))
    taker.stage(STAGES[1])
    pairs = list(zip(made.parts, facets, strict=True))
    bodies = in_threads(lambda pair: body(*pair), pairs)
    for one in bodies:
        taker.checks(one.checks)
        if one.placed_bulk is not None:
            taker.bulk(one.part.name, one.placed_bulk)
    taker.stage(STAGES[2])
    held, measured = _seats(view, bodies, taker)
    taker.stage(STAGES[3])
    ready, reason = attempt(lambda: rig(view, _known(held), measured, bodies))
    shown, why = attempt(lambda: show(require(ready, reason)))
    files = _files(bodies, "base", "cap", "stage", "frame")
    names = [(name, files, unit) for name, unit in LIGHT.items()]
    taker.checks(guarded(names, lambda: _light(view, require(shown, reason or why), names)))
    taker.stage(STAGES[4])
    _swing(view, ready, reason, bodies, taker)
    taker.prototype(rows(view, held, shown))
    return bodies


def _seats(view: View, bodies: list[Body], taker: ResultSink) -> tuple[Held | None, list[caps.Cap]]:
    files = _files(bodies, "base")
    base, reason = attempt(lambda: joined_bodies(of_roles(bodies, "base"))[0])
    held, why = attempt(lambda: seats.hold(view, require(base, reason)))
    names = [(name, files, unit) for name, unit in seats.CHECKS.items()]
    taker.checks(guarded(names, lambda: seats.checks(view, require(held, reason or why), files)))
    made = of_roles(bodies, "cap")
    if not view.made.balls.cap.any():
        return held, []
    found, odd = attempt(lambda: [caps.measure(view, one) for one in made])
    files = _files(bodies, "cap")
    names = [(name, files, unit) for name, unit in caps.CHECKS.items()]
    taker.checks(guarded(names, lambda: caps.checks(view, require(found, odd), files)))
    return held, found or []


def _swing(
    view: View, ready: Rig | None, reason: str, bodies: list[Body], taker: ResultSink
) -> None:
    files = _files(bodies, "base", "cap", "stage", "frame")
    names = [(name, files, unit) for name, unit in swing.CHECKS.items()]
    found, odd = attempt(lambda: assembly.shapes(view))
    bought, why = attempt(lambda: assembly.standing(view, require(found, odd)))
    taker.checks(
        guarded(
            names,
            lambda: swing.checks(require(ready, reason), bodies, require(bought, why), files),
        )
    )
    whole = (assembly.CHECK[0], view.made.assembly[1], assembly.CHECK[1])
    taker.checks(
        guarded([whole], lambda: [assembly.check(whole, view, bodies, require(found, odd))])
    )
    files = _files(bodies, "stage")
    names = [(name, files, unit) for name, unit in leds.CHECKS.items()]
    taker.checks(guarded(names, lambda: leds.checks(view, bodies, files)))


def _light(view: View, found: Shown, names: list[CheckName]) -> list[Check]:
    """Every mirror's ball shows all of the object at its stop, and nothing stands in between."""
    cells, covers, off, path, rays, kept = names
    ids = [view.export.rows.ids[k] for k in view.mine.tolist()]
    hidden, blocked = found.hidden.astype(float), found.blocked.astype(float)
    short = np.argsort(found.coverage, kind="stable")
    short = short[found.coverage[short] < view.export.target_mm]
    least = least_of_balls(view, found.coverage)
    recorded = view.made.balls.of("coverage_mm" if view.made.moved else "coverage_fixed_mm")
    away = np.where(np.isfinite(least), np.abs(least - recorded), 0)
    furthest = int(away.argmax())
    return [
        at_most(cells, hidden.sum(), 0, f"another mirror covers {_some(ids, hidden)}"),
        at_least(
            covers,
            float(found.coverage.min()),
            view.export.target_mm,
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


def rows(view: View, held: Held | None, found: Shown | None) -> dict[str, Any]:
    """Ball by ball and stop by stop, as verify.json has it; what is not known is null."""
    balls = view.made.balls
    count = len(balls)
    blank = np.full(count, np.nan)
    error = blank if held is None else 1000 * norm(held.centre.T - balls.columns("bx", 3))
    least = pixels = shell = blank
    stops: list[dict[str, Any]] = []
    if found is not None:
        least = least_of_balls(view, found.coverage)
        pixels, shell = (
            np.bincount(view.ball, x, count) for x in (found.pixels, found.pixels_shell)
        )
        stops = _stops(view, found)
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


def _stops(view: View, found: Shown) -> list[dict[str, Any]]:
    stop = view.made.plan.stop[view.pictures]
    return [
        {
            "stop": number,
            "base_angle_deg": _short(np.degrees(view.angle[stop == number][0])),
            "mirrors": int((stop == number).sum()),
            "coverage_mm": _short(found.coverage[stop == number].min()),
            "blocked": int(found.blocked[stop == number].sum()),
        }
        for number in np.unique(stop).tolist()
    ]


def least_of_balls(view: View, coverage: Floats) -> Floats:
    """(K,) least coverage of the mirrors that each ball stands in for; inf: of none."""
    least = np.full(len(view.made.balls), np.inf)
    np.minimum.at(least, view.ball, coverage)
    return least


def _some(ids: list[str], counts: Floats) -> str:
    worst = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    return worst_offenders(ids, counts, "rays", worst, ".0f")


def _files(bodies: list[Body], *roles: str) -> str:
    return ", ".join(one.part.stl for one in of_roles(bodies, *roles))


def _short(value: float) -> float | None:
    known = finite(float(value))
    return None if known is None else round(known, DIGITS)


def _known(held: Held | None) -> Held:
    return require(held, "the seats could not be measured")
