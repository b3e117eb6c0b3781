"""One line of the proof, and what a whole proof says."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.types import Floats

CheckName = tuple[str, str, str]  # of a check: name, file, unit
T = TypeVar("T")
NAMED = 5  # how many offenders a line names


@dataclass(frozen=True)
class Check:
    """One thing measured.

    Attributes:
        name: what.
        file: where, inside the export.
        passed: None is "unknown", and no pass.
        measured: number, None where there is none.
        limit: what it was held against; None for figures that inform only.
        unit: of both.
        detail: who offends, by how much, or why it is unknown.
    """

    name: str
    file: str
    passed: bool | None
    measured: float | None
    limit: float | None
    unit: str
    detail: str = ""


def at_most(check: CheckName, measured: float, limit: float, detail: str = "") -> Check:
    """A check that a figure does not exceed its limit; one that is not finite fails.

    Args:
        check: name, file, unit.
        measured: figure.
        limit: largest allowed.
        detail: kept when it fails.
    """
    return _held(check, measured, limit, measured <= limit, detail)


def at_least(check: CheckName, measured: float, limit: float, detail: str = "") -> Check:
    """A check that a figure reaches its limit; one that is not finite fails."""
    return _held(check, measured, limit, measured >= limit, detail)


def informative(check: CheckName, measured: float, detail: str = "") -> Check:
    """A figure without a limit: it informs, and passes."""
    return Check(check[0], check[1], True, finite(measured), None, check[2], detail)


def unknown(check: CheckName, reason: str) -> Check:
    """What could not be found out."""
    return Check(check[0], check[1], None, None, None, check[2], reason)


def check_names(units: Mapping[str, str], file: str) -> list[CheckName]:
    """Name, file and unit of every check of one file.

    Args:
        units: unit of each check, by name.
        file: where, inside the export.
    """
    return [(name, file, unit) for name, unit in units.items()]


class Unknown(Exception):
    """Something cannot be found out because something before it was not; the message says why."""


def guarded(checks: Sequence[CheckName], work: Callable[[], Sequence[Check]]) -> list[Check]:
    """Run one stage; if it breaks, everything it should have measured is unknown."""
    try:
        return list(work())
    except Exception as error:
        return [unknown(check, reason_of(error)) for check in checks]


def guarded_each(
    names: Sequence[CheckName], jobs: Sequence[Callable[..., Check]], *arguments: object
) -> list[Check]:
    """One check for each job, called with its name and the arguments; unknown if it breaks."""
    results = [
        attempt(partial(job, name, *arguments)) for name, job in zip(names, jobs, strict=True)
    ]
    return [
        unknown(name, reason) if check is None else check
        for name, (check, reason) in zip(names, results, strict=True)
    ]


def reason_of(error: Exception) -> str:
    """One line that says what broke."""
    kind = "" if isinstance(error, Unknown) else f"{type(error).__name__}: "
    return f"{kind}{error}".strip(": ").partition("\n")[0]


def finite(value: float) -> float | None:
    """The value, or None for what JSON cannot hold."""
    return float(value) if math.isfinite(value) else None


def worst_offenders(
    names: Sequence[str],
    values: Floats,
    unit: str,
    worst_first: NDArray[np.intp],
    form: str = ".2f",
) -> str:
    """The worst few by name and figure, and how many more there are."""
    shown = [f"{names[k]} {values[k]:{form}} {unit}" for k in worst_first[:NAMED].tolist()]
    return _listed(shown, len(worst_first))


def short_list(names: Sequence[str]) -> str:
    """The first few names, and how many more there are."""
    return _listed(list(names[:NAMED]), len(names))


def all_passed(checks: Sequence[Check]) -> bool:
    """True if every check passes; unknown is no pass."""
    return all(check.passed is True for check in checks)


def _held(check: CheckName, measured: float, limit: float, good: bool, detail: str) -> Check:
    name, file, unit = check
    return Check(name, file, bool(good), finite(measured), limit, unit, "" if good else detail)


def _listed(shown: list[str], count: int) -> str:
    more = count - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")


def attempt(work: Callable[[], T]) -> tuple[T | None, str]:
    """What work gives and nothing to say, or nothing and why."""
    try:
        return work(), ""
    except Exception as error:
        return None, reason_of(error)


def require(value: T | None, reason: str) -> T:
    """A value that may be missing.

    Raises:
        Unknown: it is, for this reason.
    """
    if value is None:
        raise Unknown(reason)
    return value
