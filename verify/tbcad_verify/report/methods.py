"""Question, method, limit and remedy of each check (checks.toml); key figures."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tbcad_verify.report.checks import Check
    from tbcad_verify.report.report import Report

UNKNOWN = "it could not be measured: verify again, with a larger --time-limit"
ELSE = "build again; if it stays, report it with verify.json"
QUESTIONS = {
    "see": "Does it see the object?",
    "files": "Do the files agree?",
    "made": "Can it be made?",
    "fit": "Do the parts fit?",
    "move": "Does it move safely?",
}
"""Questions of the checks, in the order of checks.toml."""


@dataclass(frozen=True)
class Method:
    """How some checks are made."""

    title: str  # of the row in the table of verify/README.md
    question: str  # that they answer: a key of QUESTIONS
    names: tuple[str, ...]  # of the checks in verify.json, or what they begin with before a blank
    method: str  # what is compared, and how
    tolerance: str  # of the figure, or where it comes from
    remedies: tuple[str, ...]  # what to do about each check that fails


@cache
def _table() -> dict[str, Any]:
    text = (files("tbcad_verify.report") / "checks.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def prototype_stages() -> dict[str, list[str]]:
    """Modules of the prototype's checks by the title of their stage, in order."""
    found: dict[str, list[str]] = _table()["prototype"]
    return found


@cache
def methods() -> tuple[Method, ...]:
    """All methods, in the order of checks.toml."""
    return tuple(
        Method(
            row["title"],
            row["question"],
            tuple(row["names"]),
            row["method"],
            row["tolerance"],
            tuple(row.get("remedies") or [row["remedy"]] * len(row["names"])),
        )
        for row in _table()["check"]
    )


def method_of(check: str) -> tuple[Method, str] | None:
    """The method of a check, by its name, and the remedy; None if it is unknown."""
    every = [
        (name, one, what)
        for one in methods()
        for name, what in zip(one.names, one.remedies, strict=True)
    ]
    fitting = [row for row in every if check == row[0] or check.startswith(row[0] + " ")]
    return max(fitting, key=lambda row: len(row[0]))[1:] if fitting else None


def remedy(check: Check) -> str:
    """Remedy of a check that did not pass."""
    return UNKNOWN if check.passed is None else remedy_by_name(check.name)


def remedy_by_name(check: str) -> str:
    """Remedy of a check that fails, by its name."""
    found = method_of(check)
    return found[1] if found else ELSE


def markdown_tables() -> str:
    """All methods as tables of Markdown, one for each question."""
    return "\n".join(
        f"### {asked}\n\n| check | method | limit |\n|---|---|---|\n"
        + "".join(
            f"| {one.title} | {one.method} | {one.tolerance} |\n"
            for one in methods()
            if one.question == question
        )
        for question, asked in QUESTIONS.items()
    )


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
    KeyFigure("centre error", "mirror error"),
    KeyFigure("ball centres", "ball error"),
    KeyFigure("mandrel draft", "mandrel draft"),
    KeyFigure("mandrel reach", "mandrel reach"),
    KeyFigure("step volume", "volume error"),
    KeyFigure("step area", "area error"),
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
    """Printers that were asked for have a limit; others inform only."""
    printers = dict.fromkeys(row["profile"] for row in report.printing)
    limited = {check.name for check in report.checks if check.limit is not None}
    names = [f"print {printer}" for printer in printers]
    return [KeyFigure(name, name[:LABEL_WIDTH], "") for name in names if name in limited]


def _margin(check: Check) -> tuple[bool, bool, float]:
    """The least for a failure, then for what is unknown, then for the smallest share left."""
    from tbcad_verify.report.checks import AT_LEAST  # the names above are wanted without numpy

    share = 0.0
    if check.measured is not None and check.limit:
        share = check.measured / check.limit
    sign = 1 if check.bound == AT_LEAST else -1
    return check.passed is not False, check.passed is True, share * sign
