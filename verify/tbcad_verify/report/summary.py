"""The summary of a verification: at most thirteen lines of 80 columns."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING

from rich.text import Text

from tbcad_verify.programs import is_skipped
from tbcad_verify.report.as_made import as_made_lines
from tbcad_verify.report.checks import Check
from tbcad_verify.report.methods import KEY_FIGURES, KeyFigure, checks_named, key_figures, remedy
from tbcad_verify.report.text import (
    MORE,
    WIDTH,
    changed_lines,
    figure,
    limit_text,
    listed_names,
    shortened,
)

if TYPE_CHECKING:
    from tbcad_verify.report.report import Report

MAX_LINES = 13
NOTE_LINES = 2  # of them, at most
FAILURE_LINES = 6  # of them, at most
AS_MADE_LINES = 2  # of them, where something failed: making it comes later
COLUMN_GAP = "  "
FigureRow = tuple[str, str, str]  # label, figure, limit
FAILURE_DIGITS = 6  # enough to tell a figure from the limit that it just misses
DIGITS = 4  # of a figure; below 1, where zeros lead, one less


def summary(report: Report) -> list[Text]:
    """Verdict, changed files, failures with remedies, key figures, what making leaves, folder."""
    failed = _failure_lines(report)
    as_made = as_made_lines(report.as_made, report.valleys)[: AS_MADE_LINES if failed else None]
    note = textwrap.wrap(report.note, WIDTH, max_lines=NOTE_LINES, placeholder=MORE)
    end = [*_skipped_line(report), *note, _end_line(report)]
    changed = changed_lines(report.checks)
    room = MAX_LINES - 1 - sum(map(len, (changed, failed, as_made, end)))
    figures = _figure_lines(report, room)
    return [_coloured(report), *map(Text, (*changed, *failed, *figures, *as_made, *end))]


def _coloured(report: Report) -> Text:
    line = Text(report.verdict)
    line.stylize("bold green" if report.passed else "bold red", 0, len("PASS"))
    return line


def _failure_lines(report: Report) -> list[str]:
    """The worst of what did not pass, each with what to do, and the names of the rest."""
    failed, unknown = (_worst_first(report.names_of(state)) for state in (False, None))
    names = list(dict.fromkeys([*failed, *unknown]))
    for count in range(len(names), -1, -1):
        lines = [*_explained(report, names[:count]), *_rest_line(names[count:])]
        if len(lines) <= FAILURE_LINES:
            return lines
    return []


def _explained(report: Report, names: Sequence[str]) -> Iterator[str]:
    """A line for each check, and one for what to do about those that share a remedy."""
    every = (*report.checks, *report.programs)
    advice: dict[str, list[str]] = {}
    for name in names:
        checks = [check for check in checks_named(every, name) if check.passed is not True]
        advice.setdefault(remedy(checks[0]), []).append(_failure(checks))
    for text, failures in advice.items():
        yield from failures
        yield f"    -> {text}"


def _worst_first(names: Sequence[str]) -> list[str]:
    """Key figures first, in their order; the others as they were made."""
    order = [one.check for one in KEY_FIGURES]
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def _failure(checks: Sequence[Check]) -> str:
    """One check: measured, limit, where, and the worst offenders."""
    first = checks[0]
    allowed = f"{first.bound} {figure(first.limit)}"
    measured = f"{figure(first.measured, FAILURE_DIGITS) or 'nothing'} {first.unit}, {allowed}"
    state = "unknown" if first.passed is None else measured
    detail = f": {first.detail}" if first.detail else ""
    files = ", ".join(dict.fromkeys(check.file for check in checks))
    return shortened(f"- {first.name}: {state}{detail}{f' ({files})' if files else ''}")


def _rest_line(names: Sequence[str]) -> Iterator[str]:
    if not names:
        return
    begin, end = f"- {len(names)} more: ", " (verify.json)"
    yield f"{begin}{listed_names(names, WIDTH - len(begin + end))}{end}"


def _figure_lines(report: Report, room: int) -> list[str]:
    """Key figures with their limits in two columns; what failed is named elsewhere."""
    rows = [
        (one.label, _short_figure(check.measured), limit_text(check, _unit(one, check)))
        for one, check in key_figures(report)
        if check.passed
    ]
    both = _in_columns(rows[: 2 * room])
    return both if max(map(len, both), default=0) <= WIDTH else _in_columns(rows[:room], 1)


def _in_columns(rows: Sequence[FigureRow], columns: int = 2) -> list[str]:
    part = math.ceil(len(rows) / columns)
    left, right = _aligned(rows[:part]), _aligned(rows[part:])
    pairs = zip_longest(left, right, fillvalue="")
    return [f"  {one}{COLUMN_GAP}{other}".rstrip() for one, other in pairs]


def _short_figure(value: float | None) -> str:
    return figure(value, DIGITS - (value is not None and abs(value) < 1))


def _unit(one: KeyFigure, check: Check) -> str:
    return check.unit if one.unit is None else one.unit


def _aligned(rows: Sequence[FigureRow]) -> list[str]:
    if not rows:
        return []
    label, measured, limit = (max(map(len, column)) for column in zip(*rows, strict=True))
    return [f"{a:<{label}} {b:>{measured}} {c:<{limit}}" for a, b, c in rows]


def _skipped_line(report: Report) -> list[str]:
    count = sum(map(is_skipped, report.programs))
    return [f"{count} questions to other programs skipped: see --full"] if count else []


def _end_line(report: Report) -> str:
    took = "" if report.seconds is None else f"{report.seconds:.0f} s; "
    place = "" if report.folder is None else f": {report.folder}"
    return f"{took}files, and every check in verify.json{place}"
