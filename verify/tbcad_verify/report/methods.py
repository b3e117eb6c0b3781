"""What each check compares, how, and with which tolerance: the record is checks.toml."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

EXPORT, AS_BUILT = "check", "as_built"  # tables of checks.toml


@dataclass(frozen=True)
class Method:
    """How some checks are made.

    Attributes:
        title: of the row in the table of verify/README.md.
        names: of the checks in verify.json, or what they begin with before a blank.
        method: what is compared, and how.
        tolerance: of the figure, or where it comes from.
    """

    title: str
    names: tuple[str, ...]
    method: str
    tolerance: str


@cache
def methods(table: str) -> tuple[Method, ...]:
    """All methods of one table, in its order: EXPORT or AS_BUILT."""
    text = (files("tbcad_verify.report") / "checks.toml").read_text(encoding="utf-8")
    rows = tomllib.loads(text)[table]
    return tuple(Method(**{**row, "names": tuple(row["names"])}) for row in rows)


def method_of(check: str) -> Method | None:
    """The method of a check, by its name; None if it is unknown."""
    every = [(name, one) for one in (*methods(EXPORT), *methods(AS_BUILT)) for name in one.names]
    fitting = [(name, one) for name, one in every if check == name or check.startswith(name + " ")]
    return max(fitting, key=lambda pair: len(pair[0]))[1] if fitting else None


def markdown_table(table: str, head: Sequence[str]) -> str:
    """The methods of one table as a table of Markdown, with the words of its head."""
    rows = [(one.title, one.method, one.tolerance) for one in methods(table)]
    lines = [f"| {' | '.join(row)} |" for row in (tuple(head), *rows)]
    return "\n".join([lines[0], "|---" * len(head) + "|", *lines[1:]]) + "\n"
