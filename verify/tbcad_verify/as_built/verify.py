"""The verification of a calibrated prototype: coverage as built, and what to shim.

Shims put each ball where the base should have it. What moves all balls alike (the angle that counts
as zero, the axis, the place of the base) is no fault of a seat: the motion of the whole base that
fits best is taken off first.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from scipy.spatial.transform import Rotation

from tbcad_verify.as_built.machine import NAME, AsBuilt, read_machine
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
    finite,
    short_list,
    worst_offenders,
)
from tbcad_verify.report.methods import remedy
from tbcad_verify.report.report import Output
from tbcad_verify.report.text import WIDTH, figure, limit_text, shortened, table
from tbcad_verify.types import Floats, Ints, Progress

HEAD = (
    "ball mirrors short coverage position shim of pad 1, 2, 3     radius  shimmed",
    "                         mm error um      um     um     um  error um       mm",
)
NOTE = (
    "A shim goes between pad and ball; a negative one is taken off the pad. 'shimmed'",
    "is the coverage with all of them: where it falls short too, the cause is radius,",
    "axis or camera. A ball without short mirrors may stay as it is.",
)
LEAST_BALLS = 3  # whose places tell a motion of the base from errors of seats
CHECKS = {
    "as built: coverage": "mm",
    "as built: stops": "mirrors",
    "as built: windows in the picture": "px",
    "as built: object clearance": "mm",
}


@dataclass(frozen=True)
class BallRow:
    """One ball."""

    number: int  # from 1
    mirrors: int  # for which it substitutes, of both runs
    short: int  # of them that show too little
    coverage_mm: float | None  # minimum of them; None where no stop is calibrated
    off_um: float  # of its centre from where the base should have it
    shim_um: tuple[float, ...]  # thickness on each of its pads
    radius_um: float  # measured less recorded
    shimmed_mm: float | None  # minimum coverage with all shims


@dataclass(frozen=True)
class AsBuiltReport:
    """The verification of one calibrated prototype."""

    target_mm: float  # diameter that every mirror must show
    checks: tuple[Check, ...]  # in order
    coverage_mm: Mapping[str, float]  # of each mirror, NaN where its stop is not calibrated
    balls: tuple[BallRow, ...]  # each with its shims
    turn_deg: float  # by which zero of the base's angle is off
    tilt_deg: float  # of the base beside that
    shift_mm: float  # of the base

    @property
    def passed(self) -> bool:
        """True if every check passed."""
        return all(check.passed is True for check in self.checks)

    @property
    def verdict(self) -> str:
        """One line."""
        count, target = len(self.coverage_mm), f"{self.target_mm:g} mm"
        if self.passed:
            return f"PASS: as built, all {count} mirrors see {target} or more on their balls"
        known = {name: x for name, x in self.coverage_mm.items() if not math.isnan(x)}
        short = sum(value < self.target_mm for value in known.values())
        if not short:
            names = "; ".join(check.name for check in self.checks if not check.passed)
            return f"FAIL: {names}"
        worst = min(known, key=known.__getitem__)
        return (
            f"FAIL: as built, {short} of {count} mirrors see less than {target}; "
            f"least {known[worst]:.2f} mm ({worst})"
        )

    def to_json(self) -> str:
        """The whole result."""
        document = {
            "pass": self.passed,
            "verdict": self.verdict,
            "target_mm": self.target_mm,
            "checks": [asdict(check) for check in self.checks],
            "base": {
                "turn_deg": self.turn_deg,
                "tilt_deg": self.tilt_deg,
                "shift_mm": self.shift_mm,
            },
            "balls": [asdict(row) for row in self.balls],
            "mirrors": {name: finite(value) for name, value in self.coverage_mm.items()},
        }
        return json.dumps(document, indent=1, allow_nan=False)

    def show(self, console: Console, output: Output = "summary") -> None:
        """Print the result: all, with every check ("full"), the verdict ("quiet"), or as JSON."""
        if output == "full":
            console.print(table(self.checks), width=min(console.width, WIDTH))
        lines = [self.verdict] if output == "quiet" else list(self._lines())
        for line in [self.to_json()] if output == "json" else lines:
            console.print(line, markup=False, highlight=False, soft_wrap=True)

    def _lines(self) -> Iterator[str]:
        yield self.verdict
        for check in self.checks:
            if not check.passed:
                measured = f"{figure(check.measured, 6) or 'nothing'} {limit_text(check)}"
                yield shortened(f"- {check.name}: {measured}: {check.detail}")
                yield f"    -> {remedy(check)}"
        yield (
            f"The whole base: error of zero {self.turn_deg:.3f} degrees, tilted by "
            f"{self.tilt_deg:.3f}, {self.shift_mm:.3f} mm aside"
        )
        yield from HEAD
        yield from map(_line, self.balls)
        yield from NOTE


def _line(row: BallRow) -> str:
    shims = "".join(f"{round(shim):>+7}" for shim in row.shim_um)
    return (
        f"{row.number:>4}{row.mirrors:>8}{row.short:>6}{_mm(row.coverage_mm):>9}"
        f"{round(row.off_um):>8}  {shims}{round(row.radius_um):>+10}{_mm(row.shimmed_mm):>9}"
    )


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def verify_as_built(
    folder: Path, calibration: Path, progress: Progress = lambda _: None
) -> AsBuiltReport:
    """Verify the prototype of a build as a calibration found it.

    `progress`: called with the name of each stage.

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
    Another radius of a cap is one about its apex, which its seat has no part in.
    """
    balls = context.prototype.balls
    growth = np.where(balls.cap, machine.radius - balls.radius_mm, 0.0) * balls.columns("nx", 3)
    designed, found = balls.columns("cx", 3) - balls.sag, machine.centre + growth
    turn, shift = _motion(designed, found)
    placed = turn.apply(designed.T).T + shift[:, None]
    off = turn.inv().apply((found - placed).T).T
    normals = np.array([seat.normals for seat in context.prototype.seats])
    shim = -np.einsum("kpi,ik->pk", normals, off)
    about = float(turn.as_rotvec() @ context.frame[0])
    aside = float(np.linalg.norm(turn.as_rotvec() - about * context.frame[0]))
    return SeatErrors(off, shim, placed - growth, about, aside, float(np.linalg.norm(shift)))


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
