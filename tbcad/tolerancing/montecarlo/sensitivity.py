"""Each kind of error by itself: what it costs, and by which factor it may grow."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from tbcad.tolerancing.montecarlo.builds import coverage_at_yield
from tbcad.tolerancing.montecarlo.draws import shell_error_shapes
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.types import Floats

WorstCoverage = Callable[[Errors], Floats]
"""Minimum coverage of each of some builds with some errors, mm, (s,)."""

LARGEST_FACTOR = 1000.0  # on an error, beyond which its kind is taken not to matter
FACTOR_TOLERANCE = 0.02  # accuracy of the factor, as a share of itself
# The next factor tried lies beyond the one that a straight line predicts, within these bounds.
OVERSHOOT, SMALLEST_STEP, LARGEST_STEP = 1.2, 1.5, 10.0


@dataclass(frozen=True)
class SingleErrorEffect:
    """Effect of one kind of error when there is no other."""

    kind: str  # its name, as in Errors
    loss: float  # mean coverage that the worst virtual camera loses, mm
    loss_at_yield: float  # the same in the worst build of those that are to be good, mm
    tolerable_factor: float  # on the error, at which the yield is just reached; may be inf


def present_kinds(errors: Errors) -> list[str]:
    """The kinds of error that are not zero."""
    return [kind for kind, error in vars(errors).items() if error.spread != 0 or error.mean != 0]


def shell_kinds(errors: Errors, walls: int) -> list[str]:
    """Those that a shell with some walls of pedestals in each half has."""
    shapes = shell_error_shapes(1, 1, walls)
    return [kind for kind in present_kinds(errors) if 0 not in shapes.get(kind, (0,))]


def only_kind(errors: Errors, kind: str) -> Errors:
    """One kind of error, and no other."""
    return replace(Errors(), **{kind: getattr(errors, kind)})


def scaled(errors: Errors, factor: float) -> Errors:
    """Errors, spread and mean, multiplied."""
    kinds: list[Error] = list(vars(errors).values())
    return Errors(*(replace(k, spread=k.spread * factor, mean=k.mean * factor) for k in kinds))


def one_at_a_time(
    errors: Errors, kind: str, wanted_yield: float, target: float, worst: WorstCoverage
) -> SingleErrorEffect:
    """Effect of one kind of error by itself, where builds must cover the target, mm."""
    single = only_kind(errors, kind)
    designed, seen = worst(Errors()).mean(), worst(single)
    return SingleErrorEffect(
        kind,
        loss=float(designed - seen.mean()),
        loss_at_yield=float(designed) - coverage_at_yield(seen, wanted_yield),
        tolerable_factor=tolerable_factor(single, wanted_yield, target, worst),
    )


def tolerable_factor(
    errors: Errors, wanted_yield: float, target: float, worst: WorstCoverage
) -> float:
    """Factor on errors up to which the yield is reached; 0 where it is missed without errors.

    The same draws are multiplied, so the loss grows steadily with the factor.
    """

    def excess(factor: float) -> float:
        return coverage_at_yield(worst(scaled(errors, factor)), wanted_yield) - target

    spare = excess(0.0)
    if spare < 0:
        return 0.0
    high, remaining = 1.0, excess(1.0)
    while remaining >= 0:
        if high >= LARGEST_FACTOR:
            return float("inf")
        step = OVERSHOOT * spare / max(spare - remaining, 1e-9)
        high *= float(np.clip(step, SMALLEST_STEP, LARGEST_STEP))
        remaining = excess(high)
    return float(brentq(excess, 0.0, high, xtol=1e-4, rtol=FACTOR_TOLERANCE, maxiter=40))
