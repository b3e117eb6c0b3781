"""Each kind of error alone: what it costs, and how much of it there may be."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.optimize import brentq

from tbcad.tolerance.montecarlo.builds import coverage_at_yield
from tbcad.tolerance.montecarlo.draws import NONE, Error, Errors
from tbcad.types import Floats

Worst = Callable[[Errors], Floats]
"""Least coverage of each of some machines made with some errors, mm, (s,)."""

# Times what a process has of an error: beyond this a kind is taken not to matter.
MOST_TIMES = 1000.0
# How exactly the factor is found, as a share of itself.
EXACT = 0.02


@dataclass(frozen=True)
class SingleErrorEffect:
    """What one kind of error costs when there is no other.

    Attributes:
        kind: its name, as in Errors.
        loss: of the worst virtual camera's coverage against the design's, mm, mean of machines.
        tail: the same in the worst machines that are still to be good, mm.
        times: what the process has of it may be multiplied by this when there is no other; infinite
            where it does not matter.
    """

    kind: str
    loss: float
    tail: float
    times: float


def kinds(errors: Errors) -> list[str]:
    """The kinds of error that a shell can have and of which there are any."""
    return [field.name for field in fields(errors) if getattr(errors, field.name) != NONE]


def only(errors: Errors, kind: str) -> Errors:
    """One kind of error, and no other."""
    return replace(Errors(), **{kind: getattr(errors, kind)})


def scaled(errors: Errors, times: float) -> Errors:
    """Errors, spread and mean, multiplied."""
    return replace(errors, **{name: _times(getattr(errors, name), times) for name in kinds(errors)})


def _times(error: Error, times: float) -> Error:
    return replace(error, spread=error.spread * times, mean=error.mean * times)


def one_at_a_time(
    errors: Errors, kind: str, wanted: float, target: float, worst: Worst
) -> SingleErrorEffect:
    """One kind of error by itself.

    Args:
        errors: all that there are.
        kind: which of them.
        wanted: share of machines that are to be good.
        target: coverage of a good machine, mm.
        worst: what machines see.
    """
    mine = only(errors, kind)
    designed, seen = worst(Errors()), worst(mine)
    tail = coverage_at_yield(seen, wanted)
    return SingleErrorEffect(
        kind,
        float(designed.mean() - seen.mean()),
        float(designed.mean()) - tail,
        loosest(mine, wanted, target, worst),
    )


def loosest(errors: Errors, wanted: float, target: float, worst: Worst) -> float:
    """How many times errors may be what they are for a yield; 0 where it is missed without them.

    The same draws are multiplied, so that what is lost grows steadily with the factor.
    """

    def left(times: float) -> float:
        return coverage_at_yield(worst(scaled(errors, times)), wanted) - target

    room = left(0.0)
    if room < 0:
        return 0.0
    high, here = 1.0, left(1.0)
    while here >= 0:
        if high >= MOST_TIMES:
            return float("inf")
        # On a straight line it would be reached here; a little beyond brackets it.
        high *= float(np.clip(1.2 * room / max(room - here, 1e-9), 1.5, 10.0))
        here = left(high)
    return float(brentq(left, 0.0, high, xtol=1e-4, rtol=EXACT, maxiter=40))
