"""Text for people, 80 columns wide: a summary of at most fourteen lines; every check; printers."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby, zip_longest
from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from tbcad_verify.programs import is_skipped
from tbcad_verify.report.as_made import as_made_lines
from tbcad_verify.report.checks import AT_LEAST, AT_MOST, EXACTLY, Check, at_most
from tbcad_verify.report.methods import KEY_FIGURES, checks_named, key_figures, remedy

if TYPE_CHECKING:
    from tbcad_verify.report.report import Report

WIDTH = 80  # columns of everything that is shown
PASS_COLUMNS = 7, 11  # of the word PASS or FAIL in the first line
MORE = " ..."
PAPER = ("paper", "manifest.json", "files")
CHANGED = "changed since the build: "
_EXPONENT_FROM = 1e6  # figures below are shown without an exponent
SIGNS = {AT_MOST: "<=", AT_LEAST: ">=", EXACTLY: "="}
# Columns of a row: check, result, measured, limit with unit. With the gaps they make 80.
WIDTHS = (26, 7, 21, 23)
SPAN_DIGITS = 3  # of the smallest and the largest of several figures
INDENT = 4
MAX_LINES = 14
NOTE_LINES = 2  # of them, at most
FAILURE_LINES = 6  # of them, at most
COLUMN_GAP = "  "
FigureRow = tuple[str, str, str]  # label, figure, limit
FAILURE_DIGITS = 6  # enough to tell a figure from the limit that it just misses
DIGITS = 4  # of a figure; below 1, where zeros lead, one less
STYLES = {"FAIL": "red", "unknown": "yellow", "skipped": "yellow", "pass": "green"}


def figure(value: float | None, digits: int = 4) -> str:
    """A figure with some digits; whole numbers whole, nothing for None."""
    if value is None:
        return ""
    if float(value).is_integer() or 10**digits <= abs(value) < _EXPONENT_FROM:
        return f"{value:.0f}"
    return f"{value:.{digits}g}"


def limit_text(check: Check, unit: str = "") -> str:
    """The limit with its sign and unit, or the unit alone of a figure without one."""
    if check.limit is None:
        return unit
    return f"{SIGNS[check.bound]} {figure(check.limit)} {unit}".rstrip()


def shortened(text: str, width: int = WIDTH) -> str:
    """The words that fit into some columns, on one line."""
    return textwrap.shorten(text, width, placeholder=MORE)


def listed_names(names: Sequence[str], width: int) -> str:
    """As many names as fit into some columns, and how many more there are."""
    for count in range(len(names), 0, -1):
        more = f" and {len(names) - count} more" if count < len(names) else ""
        text = "; ".join(names[:count]) + more
        if len(text) <= width:
            return text
    return str(len(names))


def changed_files(checks: Iterable[Check]) -> list[str]:
    """Names of the paper that was changed since the build."""
    lines = [check.detail for check in checks if check.name == PAPER[0]]
    return [name for line in lines if line for name in line.removeprefix(CHANGED).split(", ")]


def changed_lines(checks: Iterable[Check]) -> list[str]:
    """The line that says what was changed, where that is no failure; else none."""
    names = changed_files(check for check in checks if check.passed)
    return [shortened(CHANGED + ", ".join(names))] if names else []


def strictly(checks: Iterable[Check]) -> list[Check]:
    """The same checks, of which the one of paper fails where a file was changed."""
    return [
        at_most(PAPER, check.measured, 0, check.detail)
        if check.name == PAPER[0] and check.measured is not None
        else check
        for check in checks
    ]


def table(checks: Sequence[Check]) -> Group:
    """One row for each check below the name of its file; files with the same result share one.

    What is to be said about a check is on lines of its own below its row.
    """
    return Group(*_renderables(checks))


def _renderables(checks: Sequence[Check]) -> Iterator[RenderableType]:
    for files, groups in groupby(_groups(checks), _files):
        yield Text(files or "all files", style="bold")
        for group in groups:
            yield _row(group)
            if group[0].detail:
                yield Padding(Text(group[0].detail), (0, 0, 0, INDENT), expand=False)


def _row(group: Sequence[Check]) -> Table:
    first, state = group[0], _state(group[0])
    row = Table.grid(padding=(0, 1, 0, 0), pad_edge=False)
    for width, side in zip(WIDTHS, ("left", "left", "right", "left"), strict=True):
        row.add_column(width=width, justify=side, overflow="fold")  # type: ignore[arg-type]
    row.add_row(
        Text(first.name),
        Text(state, style=STYLES.get(state, "")),
        _span([check.measured for check in group]),
        Text(_limit(group)),
    )
    return row


def _files(group: Sequence[Check]) -> str:
    return group[0].file if len(group) == 1 else f"{len(group)} files"


def _groups(checks: Sequence[Check]) -> list[list[Check]]:
    """Checks that pass with the same detail for several files together; all others alone."""
    groups: dict[tuple[object, ...], list[Check]] = {}
    for k, check in enumerate(checks):
        key = (check.name, check.unit, check.limit is None, check.detail)
        groups.setdefault(key if check.passed else (k,), []).append(check)
    return list(groups.values())


def _span(values: Sequence[float | None]) -> str:
    """A figure, or the smallest and the largest."""
    known = sorted({value for value in values if value is not None})
    if len(known) < 2:
        return "".join(map(figure, known))
    ends = (figure(value, SPAN_DIGITS) for value in (known[0], known[-1]))
    return " ... ".join(dict.fromkeys(ends))


def _limit(group: Sequence[Check]) -> str:
    """The limit with its sign and unit, or the smallest and the largest."""
    first = group[0]
    if first.limit is None:
        return first.unit
    return f"{SIGNS[first.bound]} {_span([check.limit for check in group])} {first.unit}".rstrip()


def _state(check: Check) -> str:
    if check.passed is None:
        return "unknown"
    if not check.passed:
        return "FAIL"
    if is_skipped(check):
        return "skipped"
    return "info" if check.limit is None else "pass"


def printer_lines(printing: Sequence[Mapping[str, Any]]) -> list[str]:
    """For each printer how many parts it can make; parts with the same problems share a line."""
    printers = dict.fromkeys(row["profile"] for row in printing)
    return [
        line
        for name in printers
        for line in _printer(name, [row for row in printing if row["profile"] == name])
    ]


def _printer(name: str, rows: Sequence[Mapping[str, Any]]) -> Iterable[str]:
    good = [row for row in rows if not row["problems"]]
    yield f"{name} ({rows[0]['material']}): {len(good)} of {len(rows)} parts can be made"
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if row["problems"]:
            reasons.setdefault("; ".join(map(_short, row["problems"])), []).append(row["part"])
    for reason, parts in reasons.items():
        yield f"  not {', '.join(parts)}: {reason}"


def _short(problem: str) -> str:
    """The problem without what follows a colon, such as every size of the part and the bed."""
    return problem.partition(": ")[0]


def summary(report: Report) -> list[Text]:
    """Verdict, changed files, failures with remedies, key figures, medians of builds, folder."""
    failed, verdict = _failure_lines(report), report.verdict_lines
    as_made = list(as_made_lines(report.as_made, report.target_mm, report.valleys))
    if failed:  # making it comes later
        as_made = []
    note = textwrap.wrap(report.note, WIDTH, max_lines=NOTE_LINES, placeholder=MORE)
    asked = sum(map(is_skipped, report.programs))
    skipped = [f"{asked} questions to other programs skipped: see --full"] if asked else []
    end = [*skipped, *note, _end_line(report)]
    changed = changed_lines(report.checks)
    room = MAX_LINES - sum(map(len, (verdict, changed, failed, as_made, end)))
    figures = _figure_lines(report, max(room, 0))
    files, *others = map(Text, verdict)
    files.stylize("bold green" if report.passed else "bold red", *PASS_COLUMNS)
    return [files, *others, *map(Text, (*changed, *failed, *figures, *as_made, *end))]


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
        (one.label, _short_figure(check.measured), limit_text(check, unit))
        for one, check in key_figures(report)
        if check.passed
        for unit in [check.unit if one.unit is None else one.unit]
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


def _aligned(rows: Sequence[FigureRow]) -> list[str]:
    if not rows:
        return []
    label, measured, limit = (max(map(len, column)) for column in zip(*rows, strict=True))
    return [f"{a:<{label}} {b:>{measured}} {c:<{limit}}" for a, b, c in rows]


def _end_line(report: Report) -> str:
    took = "" if report.seconds is None else f"{report.seconds:.0f} s; "
    place = "" if report.folder is None else f": {report.folder}"
    return f"{took}files, and every check in verify.json{place}"
