"""Figures, limits, lists and changed files as text of limited width.

Files that people read may be edited: a change is told, and fails only where that is asked for.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from tbcad_verify.report.checks import AT_LEAST, AT_MOST, EXACTLY, Check, at_most

WIDTH = 80  # columns of everything that is shown
MORE = " ..."
PAPER = ("paper", "manifest.json", "files")
CHANGED = "changed since the build: "
_EXPONENT_FROM = 1e6  # figures below are shown without an exponent
SIGNS = {AT_MOST: "<=", AT_LEAST: ">=", EXACTLY: "="}


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
