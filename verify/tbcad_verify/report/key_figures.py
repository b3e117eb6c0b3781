"""The figures that decide whether an export is good, as one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tbcad_verify.report.checks import Check
    from tbcad_verify.report.report import Report


@dataclass(frozen=True)
class KeyFigure:
    """A figure that a summary shows."""

    check: str  # name of the check that measures it
    label: str  # what it is, in a summary; at most LABEL_WIDTH columns
    unit: str | None = None  # in a summary; None: the check's


LABEL_WIDTH = 17  # columns
# The most important first: a summary without room for all leaves the last ones out.
KEY_FIGURES = (
    KeyFigure("coverage, spheres", "coverage, spheres"),
    KeyFigure("coverage, facets", "coverage, facets"),
    KeyFigure("coverage, balls", "coverage, balls"),
    KeyFigure("mirrors found", "mirrors unmatched", ""),
    KeyFigure("light paths", "pixels blocked", ""),
    KeyFigure("light paths, balls", "rays blocked", ""),
    KeyFigure("object clearance", "clearance"),
    KeyFigure("centre error", "mirrors off"),
    KeyFigure("ball centres", "balls off"),
    KeyFigure("mandrel draft", "mandrel draft"),
    KeyFigure("step volume", "STEP volume off"),
    KeyFigure("step area", "STEP area off"),
    KeyFigure("pixels, balls", "pixels kept", "%"),
)


def key_figures(report: Report) -> list[tuple[KeyFigure, Check]]:
    """The key figures of what was built; of several files, the one nearest to its limit."""
    wanted = (*KEY_FIGURES, *_requested_printers(report))
    checked = ((one, checks_named(report.checks, one.check)) for one in wanted)
    return [(one, min(checks, key=_margin)) for one, checks in checked if checks]


def checks_named(checks: Sequence[Check], name: str) -> list[Check]:
    """The checks of one name, one for each file."""
    return [check for check in checks if check.name == name]


def _requested_printers(report: Report) -> list[KeyFigure]:
    """What was printed on request has a limit; printers that nobody asked for inform only."""
    printers = dict.fromkeys(row["profile"] for row in report.printing)
    limited = {check.name for check in report.checks if check.limit is not None}
    names = [f"print {printer}" for printer in printers]
    return [KeyFigure(name, name[:LABEL_WIDTH], "") for name in names if name in limited]


def _margin(check: Check) -> tuple[bool, bool, float]:
    """The least for a failure, then for what is unknown, then for the smallest share left."""
    share = 0.0
    if check.measured is not None and check.limit:
        share = check.measured / check.limit
    return check.passed is not False, check.passed is True, share * _sign(check)


def _sign(check: Check) -> int:
    from tbcad_verify.report.checks import AT_LEAST  # the names above are wanted without numpy

    return 1 if check.bound == AT_LEAST else -1
