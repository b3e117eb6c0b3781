"""From what a program said to checks. What it did not say clearly is unknown."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    finite,
    informative,
    unknown,
)
from tbcad_verify.run.child import Outcome

SKIPPED = "skipped: "
MAX_ANSWER = 100_000  # bytes
SHOWN = 160  # characters of a program's own words


def skipped(check: CheckName, reason: str) -> Check:
    """Nobody looked, and nobody was asked to: no failure, and no figure either."""
    return informative(check, math.nan, SKIPPED + reason)


def is_skipped(check: Check) -> bool:
    """True for what `skipped` made; it should not be shown like a pass."""
    return check.measured is None and check.detail.startswith(SKIPPED)


def count_check(check: CheckName, measured: float, limit: float, detail: str = "") -> Check:
    """A check that a count is as it should be."""
    name, file, unit = check
    good = measured == limit
    return Check(name, file, good, finite(measured), limit, unit, "" if good else detail)


def volume_check(check: CheckName, measured: float, mesh: float, error: float) -> Check:
    """A check that a volume is the mesh's.

    Args:
        check: name, file, unit.
        measured: by the program, mm^3.
        mesh: mm^3, NaN when unknown.
        error: largest difference allowed, mm^3.
    """
    if not math.isfinite(mesh + error):
        return unknown(check, "the mesh's volume is unknown")
    return at_most(
        check, abs(measured - mesh), error, f"{measured:.6g} mm^3, but the mesh has {mesh:.6g}"
    )


def text_of(outcome: Outcome) -> str:
    """What a program printed that ended well.

    Raises:
        Unknown: it did not.
    """
    if outcome.reason:
        raise Unknown(outcome.reason)
    if outcome.code != 0:
        raise Unknown(_gave_up(outcome, _last_line(outcome.text)))
    return outcome.text


def figures(outcome: Outcome, answer: Path, keys: Sequence[str]) -> dict[str, float]:
    """The numbers a script of ours wrote inside a program, as a JSON object.

    Args:
        outcome: of the program.
        answer: the script's file; with "error" in it when the script broke.
        keys: all of which must be there, as finite numbers.

    Raises:
        Unknown: it crashed, broke or left no such answer.
    """
    said = _object(answer) if outcome.code is not None else {}
    if outcome.code and isinstance(said.get("error"), str):
        raise Unknown(_gave_up(outcome, _last_line(said["error"])))
    text_of(outcome)
    if not all(_is_number(said.get(key)) for key in keys):
        raise Unknown("ended well, but left no readable answer")
    return {key: float(said[key]) for key in keys}


def _object(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as stream:
            value = json.loads(stream.read(MAX_ANSWER))
    except (OSError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def _is_number(value: Any) -> bool:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    return good and abs(value) < 1e300  # False for NaN too


def _gave_up(outcome: Outcome, last: str) -> str:
    return f"gave up with exit status {outcome.code}" + (f": {last}" if last else "")


def _last_line(text: str) -> str:
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    lines = ["".join(c for c in line if c.isprintable()).strip() for line in plain.splitlines()]
    return ([line for line in lines if line] or [""])[-1][:SHOWN]
