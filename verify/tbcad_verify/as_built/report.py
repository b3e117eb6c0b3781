"""The result for a calibrated prototype: verdict, what failed, and a table of shims by pad."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass

from rich.console import Console

from tbcad_verify.report.checks import Check, finite
from tbcad_verify.report.methods import remedy
from tbcad_verify.report.report import Output
from tbcad_verify.report.table import table
from tbcad_verify.report.text import WIDTH, figure, limit_text, shortened

HEAD = (
    "ball mirrors short coverage  off by  shim of pad 1, 2, 3 radius off  shimmed",
    "                         mm      um       um     um     um        um       mm",
)
NOTE = (
    "A shim goes between pad and ball; a negative one is taken off the pad. 'shimmed'",
    "is the coverage with all of them: where it falls short too, the cause is radius,",
    "axis or camera. A ball without short mirrors may stay as it is.",
)


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
            f"The base as a whole: zero off by {self.turn_deg:.3f} degrees, tilted by "
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
