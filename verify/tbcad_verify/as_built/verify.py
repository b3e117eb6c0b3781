"""The verification of a calibrated prototype: coverage as built, and what to shim.

Shims put each ball where the base should have it. What moves all balls alike (the angle that counts
as zero, the axis, the place of the base) is no fault of a seat: the motion of the whole base that
fits best is taken off first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad_verify.as_built.machine import NAME, AsBuilt, read_machine
from tbcad_verify.as_built.report import AsBuiltReport, BallRow
from tbcad_verify.as_built.views import HalfViews, half_views, halves
from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.vectors import joined, norm
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.export import read_export
from tbcad_verify.report.checks import (
    Check,
    at_least,
    at_most,
    check_names,
    short_list,
    worst_offenders,
)
from tbcad_verify.types import Floats, Ints, Progress

LEAST_BALLS = 3  # whose places tell a motion of the base from errors of seats
CHECKS = {
    "as built: coverage": "mm",
    "as built: stops": "mirrors",
    "as built: windows in the picture": "px",
    "as built: object clearance": "mm",
}


def verify_as_built(
    folder: Path, calibration: Path, progress: Progress = lambda _: None
) -> AsBuiltReport:
    """Verify the prototype of an export as a calibration found it.

    Args:
        folder: what `tbcad build` wrote.
        calibration: what `tbcad calibrate` wrote.
        progress: called with the name of each stage.

    Raises:
        BadExport: one cannot be read, or they do not belong together. Nothing is written.
    """
    progress("record and calibration")
    machine, export = read_machine(calibration), read_export(folder)
    if export.prototype is None:
        raise BadExport(f"{folder} has no prototype; build it, then calibrate it")
    if export.mirrors.flat.any():
        raise BadExport(f"{folder} has planar mirrors, for which no ball substitutes")
    context = PrototypeContext(export, export.prototype)
    both = halves(context, machine)
    ids = tuple(name for half in both for name in half.ids)

    def views(centre: Floats) -> HalfViews:
        return joined([half_views(context, machine, half, centre) for half in both])

    progress("coverage as built")
    now = views(machine.centre)
    progress("coverage with shims")
    errors = seat_errors(context, machine)
    ball, then = np.concatenate([half.ball for half in both]), views(errors.placed)
    return AsBuiltReport(
        export.target_mm,
        tuple(_checks(ids, now, export.target_mm)),
        dict(zip(ids, now.coverage.tolist(), strict=True)),
        tuple(_ball_rows(context, machine, errors, ball, (now.coverage, then.coverage))),
        float(np.degrees(errors.turn)),
        float(np.degrees(errors.tilt)),
        errors.shift,
    )


@dataclass(frozen=True)
class SeatErrors:
    """K seats, and the base as a whole."""

    # (3, K) from where the base should have the centres to where they are, mm, in the frame of the
    # designed base
    off: Floats
    shim: Floats  # (3, K) thickness to put on each pad, mm; negative: to take away
    placed: Floats  # (3, K) where centres are once this is done, mm, with the base at angle zero
    turn: float  # of the whole base about its axis, radians, by which zero is off
    tilt: float  # of the whole base beside that, radians
    shift: float  # of the whole base, mm


def seat_errors(context: PrototypeContext, machine: AsBuilt) -> SeatErrors:
    """Compare the balls with the record, and solve the shims of all pads.

    A ball that lies on three planes moves by d where each plane is raised by n.d along its normal.
    """
    designed, found = context.prototype.balls.columns("cx", 3), machine.centre
    turn, shift = _motion(designed, found)
    placed = turn.apply(designed.T).T + shift[:, None]
    off = turn.inv().apply((found - placed).T).T
    normals = np.array([seat.normals for seat in context.prototype.seats])
    shim = -np.einsum("kpi,ik->pk", normals, off)
    about = float(turn.as_rotvec() @ context.frame[0])
    aside = float(np.linalg.norm(turn.as_rotvec() - about * context.frame[0]))
    return SeatErrors(off, shim, placed, about, aside, float(np.linalg.norm(shift)))


def _motion(designed: Floats, found: Floats) -> tuple[Rotation, Floats]:
    """The rigid motion that takes designed points (3, K) nearest to the found ones."""
    if designed.shape[1] < LEAST_BALLS:
        return Rotation.identity(), np.zeros(3)
    middles = designed.mean(axis=1), found.mean(axis=1)
    before, after = designed - middles[0][:, None], found - middles[1][:, None]
    turn, _ = Rotation.align_vectors(after.T, before.T)
    return turn, middles[1] - turn.apply(middles[0])


def _checks(ids: Sequence[str], views: HalfViews, target: float) -> list[Check]:
    covers, stops, picture, clear = check_names(CHECKS, NAME)
    missing = np.isnan(views.coverage)

    def least(values: Floats) -> float:
        return float(np.nanmin(values)) if not missing.all() else np.nan

    def worst(values: Floats, unit: str, limit: float) -> str:
        bad = values < limit
        return worst_offenders(ids, values, unit, bad, badness=-np.nan_to_num(values))

    lost = short_list([ids[k] for k in np.flatnonzero(missing).tolist()])
    return [
        at_least(covers, least(views.coverage), target, worst(views.coverage, "mm", target)),
        at_most(stops, float(missing.sum()), 0, f"stops of {lost} are not calibrated"),
        at_least(picture, least(views.margin), 0, worst(views.margin, "px", 0)),
        at_least(clear, least(views.clearance), 0, worst(views.clearance, "mm", 0)),
    ]


def _ball_rows(
    context: PrototypeContext,
    machine: AsBuilt,
    errors: SeatErrors,
    ball: Ints,
    coverage: tuple[Floats, Floats],
) -> list[BallRow]:
    """One for each ball, with the coverage (M,) as built and with shims of what it shows."""
    target, rows = context.export.target_mm, []
    radius = 1000 * (machine.radius - context.prototype.balls.radius_mm)
    for k, off in enumerate((1000 * norm(errors.off)).tolist()):
        mine = ball == k
        before, after = (one[mine] for one in coverage)
        rows.append(
            BallRow(
                number=k + 1,
                mirrors=int(mine.sum()),
                short=int((before < target).sum()),
                coverage_mm=_minimum(before),
                off_um=off,
                shim_um=tuple((1000 * errors.shim[:, k]).tolist()),
                radius_um=float(radius[k]),
                shimmed_mm=_minimum(after),
            )
        )
    return rows


def _minimum(values: Floats) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.min()) if known.size else None
