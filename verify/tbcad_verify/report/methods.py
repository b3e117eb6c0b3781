"""What each check compares, how, and what to do when it fails: the record is checks.toml."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tbcad_verify.report.checks import Check

UNKNOWN = "it could not be measured: verify again, with a larger --time-limit"
ELSE = "build again; if it stays, report it with verify.json"
EXPORT, AS_BUILT = "check", "as_built"  # tables of checks.toml


@dataclass(frozen=True)
class Method:
    """How some checks are made."""

    title: str  # of the row in the table of verify/README.md
    names: tuple[str, ...]  # of the checks in verify.json, or what they begin with before a blank
    method: str  # what is compared, and how
    tolerance: str  # of the figure, or where it comes from
    remedies: tuple[str, ...]  # what to do about each check that fails


@cache
def methods(table: str) -> tuple[Method, ...]:
    """All methods of one table, in its order: EXPORT or AS_BUILT."""
    text = (files("tbcad_verify.report") / "checks.toml").read_text(encoding="utf-8")
    rows = tomllib.loads(text)[table]
    return tuple(
        Method(
            row["title"],
            tuple(row["names"]),
            row["method"],
            row["tolerance"],
            tuple(row.get("remedies") or [row["remedy"]] * len(row["names"])),
        )
        for row in rows
    )


def method_of(check: str) -> tuple[Method, str] | None:
    """The method of a check, by its name, and the remedy; None if it is unknown."""
    every = [
        (name, one, what)
        for one in (*methods(EXPORT), *methods(AS_BUILT))
        for name, what in zip(one.names, one.remedies, strict=True)
    ]
    fitting = [row for row in every if check == row[0] or check.startswith(row[0] + " ")]
    return max(fitting, key=lambda row: len(row[0]))[1:] if fitting else None


def remedy(check: Check) -> str:
    """What to do about a check that did not pass."""
    return UNKNOWN if check.passed is None else remedy_by_name(check.name)


def remedy_by_name(check: str) -> str:
    """What to do about a check that fails, by its name."""
    found = method_of(check)
    return found[1] if found else ELSE


def markdown_table(table: str, head: Sequence[str]) -> str:
    """The methods of one table as a table of Markdown, with the words of its head."""
    rows = [(one.title, one.method, one.tolerance) for one in methods(table)]
    lines = [f"| {' | '.join(row)} |" for row in (tuple(head), *rows)]
    return "\n".join([lines[0], "|---" * len(head) + "|", *lines[1:]]) + "\n"
