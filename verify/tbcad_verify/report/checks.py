"""One line of the verification: a measured figure against its limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from tbcad_verify.types import Bools, Floats

CheckName = tuple[str, str, str]  # of a check: name, file, unit
AT_MOST, AT_LEAST, EXACTLY = "at most", "at least", "exactly"  # what a limit asks of a figure
T = TypeVar("T")
MAX_NAMED = 5  # how many offenders a line names


@dataclass(frozen=True)
class Check:
    """One figure and its limit."""

    name: str  # what was measured
    file: str  # in which file of the build
    passed: bool | None  # None is "unknown", which is not a pass
    measured: float | None  # the figure, or None
    limit: float | None  # of the figure; None if it informs only
    unit: str  # of both
    detail: str = ""  # what exceeds the limit, and by how much; or why it is unknown
    bound: str = AT_MOST  # whether the figure may be at most, at least or exactly the limit


def at_most(check: CheckName, measured: float, limit: float, detail: str = "") -> Check:
    """A check that a figure does not exceed its limit; NaN fails.

    `check`: name, file, unit.
    """
    return _limited(check, measured, limit, measured <= limit, detail, AT_MOST)


def at_least(check: CheckName, measured: float, limit: float, detail: str = "") -> Check:
    """A check that a figure reaches its limit; NaN fails."""
    return _limited(check, measured, limit, measured >= limit, detail, AT_LEAST)


def exactly(check: CheckName, measured: float, limit: float, detail: str = "") -> Check:
    """A check that a figure has its only allowed value; NaN fails."""
    return _limited(check, measured, limit, measured == limit, detail, EXACTLY)


def no_faults(check: CheckName, faults: Iterable[str]) -> Check:
    """A check that counts faults; the detail names the first."""
    found = list(faults)
    return at_most(check, len(found), 0, short_list(found))


def informative(check: CheckName, measured: float, detail: str = "") -> Check:
    """A figure without a limit: it passes."""
    return Check(check[0], check[1], True, finite(measured), None, check[2], detail)


def unknown(check: CheckName, reason: str) -> Check:
    """A check that could not be made."""
    return Check(check[0], check[1], None, None, None, check[2], reason)


def check_names(units: Mapping[str, str], file: str) -> list[CheckName]:
    """Name, file and unit of every check of one file.

    `units`: unit of each check, by name.
    """
    return [(name, file, unit) for name, unit in units.items()]


class Unknown(Exception):
    """A figure cannot be measured, because what it needs is missing; the message says why."""


def guarded(checks: Sequence[CheckName], work: Callable[[], Sequence[Check]]) -> list[Check]:
    """The checks that `work` makes; all are unknown if it breaks."""
    try:
        return list(work())
    except Exception as error:
        return [unknown(check, reason_of(error)) for check in checks]


def guarded_each(
    names: Sequence[CheckName], jobs: Sequence[Callable[..., Check]], *arguments: object
) -> list[Check]:
    """One check for each job, called with its name and the arguments; unknown if it breaks."""

    def make(name: CheckName, job: Callable[..., Check]) -> list[Check]:
        return guarded([name], lambda: [job(name, *arguments)])

    return [check for pair in zip(names, jobs, strict=True) for check in make(*pair)]


def reason_of(error: Exception) -> str:
    """One line that names the error."""
    kind = "" if isinstance(error, Unknown) else f"{type(error).__name__}: "
    return f"{kind}{error}".strip(": ").partition("\n")[0]


def finite(value: float) -> float | None:
    """The value, or None for what JSON cannot hold."""
    return float(value) if math.isfinite(value) else None


def worst_offenders(
    names: Sequence[str],
    values: Floats,
    unit: str,
    bad: Bools,
    form: str = ".2f",
    badness: Floats | None = None,
) -> str:
    """The worst few of what is bad, by name and figure, and how many more there are.

    `values`: (N,) figures.
    `bad`: (N,) true for what is to be named.
    `badness`: (N,) largest for the worst; None: the values.
    """
    order = np.argsort(-(values if badness is None else badness), kind="stable")
    worst = order[bad[order]]
    shown = [f"{names[k]} {values[k]:{form}} {unit}" for k in worst[:MAX_NAMED].tolist()]
    return _listed(shown, worst.size)


def each_at_most(
    check: CheckName,
    names: Sequence[str],
    errors: Floats,
    limit: float,
    unit: str,
    reason: str = "",
) -> Check:
    """A check that none of (N,) errors exceeds a limit; the detail names the worst."""
    who = worst_offenders(names, errors, unit, ~(errors <= limit), ".3g")
    return at_most(check, float(errors.max(initial=0)), limit, reason + who)


def short_list(names: Sequence[str]) -> str:
    """The first few names, and how many more there are."""
    return _listed(list(names[:MAX_NAMED]), len(names))


def _limited(
    check: CheckName, measured: float, limit: float, good: bool, detail: str, bound: str
) -> Check:
    name, file, unit = check
    shown = "" if good else detail
    return Check(name, file, bool(good), finite(measured), limit, unit, shown, bound)


def _listed(shown: list[str], count: int) -> str:
    more = count - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")


def attempt(work: Callable[[], T]) -> tuple[T | None, str]:
    """The value of `work` and "", or None and the reason why it broke."""
    try:
        return work(), ""
    except Exception as error:
        return None, reason_of(error)


def require(value: T | None, reason: str) -> T:
    """A value that may be missing. Unknown: it is missing, for this reason."""
    if value is None:
        raise Unknown(reason)
    return value
