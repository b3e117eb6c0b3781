"""Files that people read and may edit: a change is told, and fails only where that is asked for."""

from __future__ import annotations

from collections.abc import Iterable

from tbcad_verify.report.checks import Check, at_most
from tbcad_verify.report.text import shortened

PAPER = ("paper", "manifest.json", "files")
CHANGED = "changed since the build: "


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
