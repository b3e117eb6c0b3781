"""Checks as a table for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from tbcad_verify.programs import is_skipped
from tbcad_verify.report.checks import Check


def table(checks: Sequence[Check]) -> Table:
    """One row for each check; files with the same result share one."""
    rows = Table(title=None, box=None, pad_edge=False)
    for name, side in (
        ("check", "left"),
        ("file", "left"),
        ("", "left"),
        ("measured", "right"),
        ("limit", "right"),
        ("unit", "left"),
        ("", "left"),
    ):
        rows.add_column(name, justify=side, overflow="fold")  # type: ignore[arg-type]
    for group in _groups(checks):
        first = group[0]
        rows.add_row(
            first.name,
            escape(first.file) if len(group) == 1 else f"{len(group)} files",
            _mark(first),
            _span([check.measured for check in group]),
            _span([check.limit for check in group]),
            first.unit,
            escape(first.detail),
        )
    return rows


def _groups(checks: Sequence[Check]) -> list[list[Check]]:
    """Checks that pass with the same detail for several files together; all others alone."""
    groups: dict[tuple[object, ...], list[Check]] = {}
    for k, check in enumerate(checks):
        key = (check.name, check.unit, check.limit is None, check.detail)
        groups.setdefault(key if check.passed else (k,), []).append(check)
    return list(groups.values())


def _span(values: Sequence[float | None]) -> str:
    """A figure, or the smallest and the largest."""
    figures = [_figure(value) for value in sorted(value for value in values if value is not None)]
    return " ... ".join(dict.fromkeys([*figures[:1], *figures[-1:]]))


def _mark(check: Check) -> str:
    if check.passed is None:
        return "[yellow]unknown[/]"
    if not check.passed:
        return "[red]FAIL[/]"
    if is_skipped(check):
        return "[yellow]skipped[/]"
    return "info" if check.limit is None else "[green]pass[/]"


def _figure(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.4g}"
