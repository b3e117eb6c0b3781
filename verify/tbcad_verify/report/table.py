"""Checks as a table for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from tbcad_verify.programs import is_skipped
from tbcad_verify.report.checks import Check


def table(checks: Sequence[Check]) -> Table:
    """One row a check; files of which the same is true share one."""
    made = Table(title=None, box=None, pad_edge=False)
    for name, side in (
        ("check", "left"),
        ("file", "left"),
        ("", "left"),
        ("measured", "right"),
        ("limit", "right"),
        ("unit", "left"),
        ("", "left"),
    ):
        made.add_column(name, justify=side, overflow="fold")  # type: ignore[arg-type]
    for alike in _alike(checks):
        first = alike[0]
        made.add_row(
            first.name,
            escape(first.file) if len(alike) == 1 else f"{len(alike)} files",
            _mark(first),
            _span([check.measured for check in alike]),
            _span([check.limit for check in alike]),
            first.unit,
            escape(first.detail),
        )
    return made


def _alike(checks: Sequence[Check]) -> list[list[Check]]:
    """Checks that say the same of several files and pass, in one row; all others alone."""
    groups: dict[tuple[object, ...], list[Check]] = {}
    for k, check in enumerate(checks):
        said = (check.name, check.unit, check.limit is None, check.detail)
        groups.setdefault(said if check.passed else (k,), []).append(check)
    return list(groups.values())


def _span(values: Sequence[float | None]) -> str:
    """A figure, or the least and the greatest."""
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
