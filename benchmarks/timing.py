"""Clocks and table rows. Works that are compared run in turns, so that all meet the same load.

Nothing here is a limit that a test enforces: seconds depend on the machine and on what else runs.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

Work = Callable[[], object]


@dataclass(frozen=True)
class Figure:
    """One value a round, in the order of the rounds."""

    values: tuple[float, ...]

    @property
    def median(self) -> float:
        return statistics.median(self.values)

    @property
    def minimum(self) -> float:
        return min(self.values)

    def over(self, other: Figure) -> Figure:
        """Ratios, round by round."""
        return Figure(tuple(a / b for a, b in zip(self.values, other.values, strict=True)))

    def rate(self, count: float) -> Figure:
        """So many things a second, where the values are the seconds for all of them."""
        return Figure(tuple(count / value for value in self.values))

    def __str__(self) -> str:
        if len(self.values) == 1:
            return shown(self.median)
        return f"{shown(self.median)} ({shown(min(self.values))} ... {shown(max(self.values))})"


@dataclass(frozen=True)
class Row:
    """A line of the table.

    Attributes:
        what: is measured.
        values: one a round.
        unit: of the values.
        limit: of the median; None where there is none.
        bound: "at most" or "at least", for the limit.
        note: in place of values that could not be measured.
    """

    what: str
    values: tuple[float, ...]
    unit: str = ""
    limit: float | None = None
    bound: str = "at most"
    note: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether the median keeps the limit; None without a limit."""
        if self.limit is None:
            return None
        median = Figure(self.values).median
        return median <= self.limit if self.bound == "at most" else median >= self.limit

    def __str__(self) -> str:
        value = f"{Figure(self.values)} {self.unit}".rstrip() if self.values else self.note
        limit = "" if self.limit is None else f"{self.bound} {self.limit:g} {self.unit}".rstrip()
        verdict = {None: "", True: "yes", False: "NO"}[self.holds]
        return f"| {self.what} | {value} | {limit} | {verdict} |"


def measured(what: str, figure: Figure, unit: str = "") -> Row:
    """A figure without a limit."""
    return Row(what, figure.values, unit)


def at_most(what: str, figure: Figure, limit: float, unit: str = "") -> Row:
    """A figure whose median must not be above a limit."""
    return Row(what, figure.values, unit, limit)


def at_least(what: str, figure: Figure, limit: float, unit: str = "") -> Row:
    """A figure whose median must not be below a limit."""
    return Row(what, figure.values, unit, limit, "at least")


@dataclass(frozen=True)
class Spent:
    """What a work took, a value a round: seconds on the clock, and of all cores together."""

    seconds: Figure
    cpu: Figure


def in_turns(works: Sequence[Work], rounds: int) -> list[Figure]:
    """Seconds of each work, once a round; every other round runs backward. One round is a warm-up.

    The warm-up pays for imports and first touches of memory, and is not counted.
    """
    return [spent.seconds for spent in spent_in_turns(works, rounds)]


def spent_in_turns(works: Sequence[Work], rounds: int) -> list[Spent]:
    """As `in_turns`, with the processor's time of this process and of those it waited for."""
    taken: list[list[tuple[float, float]]] = [[] for _ in works]
    for turn in range(rounds + 1):
        order = range(len(works))
        for k in reversed(order) if turn % 2 else order:
            taken[k].append(_seconds(works[k]))
    figures = [[Figure(values) for values in zip(*rows[1:], strict=True)] for rows in taken]
    return [Spent(*pair) for pair in figures]


def shown(value: float) -> str:
    """Three digits, never as a power of ten."""
    digits = 0 if value >= 100 else 1 if value >= 10 else 2
    return f"{value:.{digits}f}"


def _seconds(work: Work) -> tuple[float, float]:
    start, used = time.perf_counter(), _used()
    result = work()
    taken = time.perf_counter() - start, _used() - used
    del result  # after the clock: freeing a solid is nobody's work
    return taken


def _used() -> float:
    return sum(os.times()[:4])
