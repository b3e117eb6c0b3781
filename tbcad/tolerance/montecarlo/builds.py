"""Thousands of machines as they might come out: what each sees, and how many see enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from math import sqrt
from statistics import NormalDist
from typing import TypeVar

import numpy as np

from tbcad.simulate.parallel import in_threads
from tbcad.tolerance.montecarlo.coverage import coverage
from tbcad.tolerance.montecarlo.draws import Errors, draw
from tbcad.tolerance.montecarlo.edge_model import EdgeModel
from tbcad.tolerance.montecarlo.pointing import pointing
from tbcad.types import Floats, Ints

# Machines that a worker makes in one go: few enough that all workers end together.
BATCH = 10
# How surely the true yield lies in the interval that is told.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class MonteCarloCase:
    """What a worker needs to make machines.

    Attributes:
        halves: both halves as designed.
        errors: how exactly they are made.
        seed: of all machines.
    """

    halves: tuple[EdgeModel, EdgeModel]
    errors: Errors
    seed: int


@dataclass(frozen=True)
class Covered:
    """What s machines see, in the order of their numbers, over v virtual cameras.

    Attributes:
        coverage: exact coverage diameters, mm, (s, v).
    """

    coverage: Floats

    def __len__(self) -> int:
        """Number of machines."""
        return len(self.coverage)

    @property
    def worst(self) -> Floats:
        """Least coverage of each machine, mm, (s,)."""
        result: Floats = self.coverage.min(axis=1)
        return result

    @property
    def worst_camera(self) -> Ints:
        """Number of the virtual camera that sees least, of each machine, (s,)."""
        result: Ints = np.argmin(self.coverage, axis=1)
        return result

    def quantiles(self, shares: Sequence[float]) -> Floats:
        """Coverage, mm, (k, v), that k shares of the machines do not reach at each camera."""
        result: Floats = np.quantile(self.coverage, shares, axis=0)
        return result


@dataclass(frozen=True)
class Result(Covered):
    """What s machines see, and where 2 m mirrors point: a's mirrors, b's.

    Attributes:
        pixels: sizes of the pictures, (s, v).
        angle: pointing errors of an uncalibrated machine, radians, (s, 2 m).
        offset: distances of the same rays from the object's middle, mm, (s, 2 m).
    """

    pixels: Floats
    angle: Floats
    offset: Floats


@dataclass(frozen=True)
class Yield:
    """Share of machines whose every virtual camera sees enough.

    Attributes:
        share: of the machines that were made.
        low: the true share is hardly less.
        high: the true share is hardly more.
    """

    share: float
    low: float
    high: float


def simulate(
    task: MonteCarloCase, machines: int, each: Each = in_threads, first: int = 0
) -> Result:
    """Make machines and see what they see; the same whoever works, and in what batches.

    Args:
        task: what to make.
        machines: how many, at least one.
        each: makes batches of machines, in order: threads, processes or a cluster.
        first: number of the first machine.
    """
    return joined(each(Work(task), batches(machines, first)))


def batches(machines: int, first: int) -> list[range]:
    """Numbers of so many machines, as they are made together."""
    last = first + machines
    return [range(k, min(k + BATCH, last)) for k in range(first, last, BATCH)]


@dataclass(frozen=True)
class Work:
    """Makes machines of a task; it can be sent to another process."""

    task: MonteCarloCase

    def __call__(self, machines: range) -> Result:
        """What the machines of these numbers see."""
        halves = self.task.halves
        draws = draw(self.task.errors, self.task.seed, machines, len(halves[0]))
        diameter, pixels = coverage(halves, draws)
        rays = [pointing(half, drawn) for half, drawn in zip(halves, draws, strict=True)]
        angle = np.concatenate([ray.angle for ray in rays], axis=1)
        offset = np.concatenate([ray.offset for ray in rays], axis=1)
        return Result(diameter, pixels, angle, offset)


Each = Callable[[Work, Sequence[range]], list[Result]]
Seen = TypeVar("Seen", bound=Covered)


def joined(results: Sequence[Seen]) -> Seen:
    """Results of machines in order as one; at least one is needed."""
    kind = type(results[0])
    names = [field.name for field in fields(kind)]
    return kind(*(np.concatenate([getattr(one, name) for one in results]) for name in names))


def coverage_at_yield(worst: Floats, share: float) -> float:
    """Coverage, mm, that a share of the machines reach with their worst camera (s,).

    It is the target or more exactly where that share of them is good: an order statistic, nothing
    between two machines.
    """
    bad = int((1 - share) * len(worst) + 1e-9)
    return float(np.sort(worst)[min(bad, len(worst) - 1)])


def yielded(worst: Floats, target: float) -> Yield:
    """Share of machines whose worst coverage (s,) is the target (mm), with Wilson's interval.

    E. B. Wilson, Probable inference, J. Am. Stat. Assoc. 22 (1927) 209-212; here at 95 %.
    """
    good, count = int(np.count_nonzero(worst >= target)), len(worst)
    low, high = wilson(good, count)
    return Yield(good / count, low, high)


def wilson(good: int, count: int) -> tuple[float, float]:
    """Ends of Wilson's interval for a share of which `good` out of `count` were seen."""
    z = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)
    share = good / count
    middle = share + z * z / (2 * count)
    width = z * sqrt(share * (1 - share) / count + (z / (2 * count)) ** 2)
    low, high = ((middle + sign * width) / (1 + z * z / count) for sign in (-1, 1))
    return (low if good else 0.0), (high if good < count else 1.0)
