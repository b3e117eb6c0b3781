"""Figures, limits and lists as text of limited width."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from tbcad_verify.report.checks import AT_LEAST, AT_MOST, EXACTLY, Check

WIDTH = 80  # columns of everything that is shown
MORE = " ..."
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
