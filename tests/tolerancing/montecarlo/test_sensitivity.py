"""What each kind of error costs alone, against losses that are known in closed form."""

from collections.abc import Callable
from dataclasses import fields
from itertools import product

import numpy as np
import pytest

from tbcad.tolerancing.montecarlo.builds import (
    FACTOR_TOLERANCE,
    LARGEST_FACTOR,
    MonteCarloCase,
    coverage_at_yield,
    estimate_yield,
    one_at_a_time,
    scaled,
    simulate,
    tolerable_factor,
)
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors

MIXED = Errors(
    sphere_centre=Error(0.02),
    coating=Error(0.01, 0.03, "uniform"),
    facets=Error(0.0, 0.36),
    seat=Error(0.1),
)
TARGET = 60.0
ROOM = 0.6


def synthetic(loss: Callable[[float], float]) -> Callable[[Errors], np.ndarray]:
    """Machines that all lose what a law makes of the mean of facets."""
    return lambda errors: np.full(7, TARGET + ROOM - loss(errors.facets.mean))


def real(halves: EdgeModels, builds: int) -> Callable[[Errors], np.ndarray]:
    return lambda errors: simulate(MonteCarloCase(halves, errors, 3), builds).worst


def test_scaled_multiplies_spread_and_mean_and_nothing_else() -> None:
    twice = scaled(MIXED, 2.5)
    for field in fields(Errors):
        before, after = getattr(MIXED, field.name), getattr(twice, field.name)
        assert after.spread == pytest.approx(2.5 * before.spread, rel=1e-15)
        assert after.mean == pytest.approx(2.5 * before.mean, rel=1e-15)
        assert after.distribution == before.distribution
    assert scaled(MIXED, 1.0) == MIXED


def factor_of(mean: float, loss: Callable[[float], float]) -> float:
    return tolerable_factor(Errors(facets=Error(0, mean)), 0.9, TARGET, synthetic(loss))


def test_factors_of_losses_in_closed_form() -> None:
    """The loss is the mean's power: the factor is the root of the room over the mean.

    Where nothing is lost up to three times, and all beyond, no straight line leads to it. What
    costs nothing may be anything, and what would be reached at a million times.
    """
    for power, mean in product((0.5, 1.0, 3.0), (0.02, 0.4, 5.0)):
        wanted = pytest.approx(ROOM ** (1 / power) / mean, rel=FACTOR_TOLERANCE, abs=1e-4)
        assert factor_of(mean, lambda x, power=power: x**power) == wanted  # type: ignore[misc]
    cliff = factor_of(1.0, lambda x: 50.0 if x > 3 else 0.0)
    assert cliff == pytest.approx(3.0, rel=FACTOR_TOLERANCE)
    for loss in (lambda _: 0.0, lambda x: x):
        assert factor_of(ROOM / 1e6, loss) == np.inf


@pytest.mark.parametrize("count", [1, 10, 101])
def test_share_is_good_exactly_where_it_is_reached(count: int) -> None:
    """For every share that so many builds can have, and those between."""
    worst = np.random.default_rng(count).normal(TARGET, 1, count)
    for wanted in np.arange(1, 2 * count) / (2 * count):
        for target in worst:
            good = estimate_yield(worst, target).share >= wanted
            assert (coverage_at_yield(worst, wanted) >= target) == good


def test_design_that_falls_short_allows_nothing() -> None:
    some = Errors(facets=Error(0, 0.1))
    assert tolerable_factor(some, 0.99, TARGET + ROOM + 0.001, synthetic(lambda x: x)) == 0
    assert tolerable_factor(some, 0.99, TARGET + ROOM - 0.001, synthetic(lambda x: x)) > 0


def test_quantile_of_the_builds_decides_not_their_mean() -> None:
    """Machine k of 101 loses k per cent: at a yield of 0.75 the one that loses 75 % counts."""

    def worst(errors: Errors) -> np.ndarray:
        return TARGET + ROOM - errors.facets.mean * np.linspace(0, 1, 101)

    found = tolerable_factor(Errors(facets=Error(0, 0.4)), 0.75, TARGET, worst)
    assert found == pytest.approx(ROOM / (0.4 * 0.75), rel=FACTOR_TOLERANCE)
    one = one_at_a_time(MIXED, "facets", 0.75, TARGET, worst)
    assert one.kind == "facets"
    assert one.loss == pytest.approx(0.36 / 2)
    assert one.loss_at_yield == pytest.approx(0.36 * 0.75)
    assert one.tolerable_factor == pytest.approx(ROOM / (0.36 * 0.75), rel=FACTOR_TOLERANCE)


@pytest.mark.parametrize(
    ("kind", "error"),
    [("sphere_centre", Error(0.025)), ("camera_shift", Error(0.11)), ("coating", Error(0, 0.3))],
)
def test_builds_with_the_factor_just_do(halves: EdgeModels, kind: str, error: Error) -> None:
    """A little less makes the wanted share good; a little more does not."""
    worst, errors = real(halves, 20), Errors(**{kind: error})
    times = tolerable_factor(errors, 0.9, TARGET, worst)
    assert 0 < times < LARGEST_FACTOR
    less, more = (
        estimate_yield(worst(scaled(errors, times * by)), TARGET).share
        for by in (1 - 2 * FACTOR_TOLERANCE, 1 + 2 * FACTOR_TOLERANCE)
    )
    assert more < 0.9 <= less


def test_camera_that_turns_about_its_pinhole_is_harmless(halves: EdgeModels) -> None:
    """Coverage hangs on places of pinhole and mirrors alone."""
    one = one_at_a_time(
        Errors(camera_tilt=Error(0.003)), "camera_tilt", 0.9, TARGET, real(halves, 10)
    )
    assert one.loss == pytest.approx(0, abs=1e-9)
    assert one.tolerable_factor == np.inf
