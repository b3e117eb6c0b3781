"""Simulated builds: the same whoever works, how many are good, and what errors cost."""

import pickle
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from itertools import product

import numpy as np
import pytest
from scipy.stats import binomtest

from tbcad.tolerancing.montecarlo.builds import (
    BUILDS_PER_BATCH,
    FACTOR_TOLERANCE,
    LARGEST_FACTOR,
    CoverageResult,
    MonteCarloCase,
    coverage_at_yield,
    estimate_yield,
    joined_results,
    one_at_a_time,
    scaled,
    simulate,
    tolerable_factor,
    wilson_interval,
)
from tbcad.tolerancing.montecarlo.draws import ShellDraws, draw
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors

SOME = Errors(sphere_centre=Error(0.02), camera_shift=Error(0.1), scale_axis=Error(0.001))
BUILDS = 2 * BUILDS_PER_BATCH + 3
ARRAYS = ("coverage", "offset")
M = 4
ALL = Errors(**{field.name: Error(0.001) for field in fields(Errors)})
# The foot moves where neighbours share a warp, see test_warp.
NAMES = [field.name for field in fields(ShellDraws) if field.name != "foot"]


@pytest.fixture(scope="module")
def case(halves: EdgeModels) -> MonteCarloCase:
    return MonteCarloCase(halves, SOME, 11)


@pytest.fixture(scope="module")
def result(case: MonteCarloCase) -> CoverageResult:
    return simulate(case, BUILDS)


def same(one: CoverageResult, two: CoverageResult) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in ARRAYS)


def backward(case: MonteCarloCase, batches: Sequence[range]) -> list[CoverageResult]:
    """Three threads that take the batches last first."""
    with ThreadPoolExecutor(3) as pool:
        return list(pool.map(case, batches[::-1]))[::-1]


def pickled(case: MonteCarloCase, batches: Sequence[range]) -> list[CoverageResult]:
    """As another process would have it."""
    return [pickle.loads(pickle.dumps(case))(batch) for batch in batches]


@pytest.mark.parametrize("run_batches", [backward, pickled])
def test_same_figures_with_any_workers(
    case: MonteCarloCase, result: CoverageResult, run_batches: object
) -> None:
    assert same(simulate(case, BUILDS, run_batches), result)  # type: ignore[arg-type]


def test_later_builds_continue_earlier_ones(case: MonteCarloCase, result: CoverageResult) -> None:
    parts = [simulate(case, 5), simulate(case, BUILDS - 5, first=5)]
    assert same(joined_results(parts), result)


def test_worst_and_quantiles(result: CoverageResult) -> None:
    assert len(result) == BUILDS
    assert result.coverage.shape == (BUILDS, 193)
    assert result.offset.shape == (BUILDS, 206)
    rows = np.arange(BUILDS)
    assert np.array_equal(result.coverage[rows, result.worst_camera], result.worst)
    assert np.all(result.worst[:, None] <= result.coverage)
    low, middle, high = result.quantiles([0, 0.5, 1])
    assert np.array_equal(low, result.coverage.min(axis=0))
    assert np.array_equal(high, result.coverage.max(axis=0))
    assert np.all((low < middle) & (middle < high))


def test_yield_and_its_interval() -> None:
    """By scipy; one that R. G. Newcombe, Stat. Med. 17 (1998) 857-872, table I, method 3 has."""
    for good, count in ((0, 10), (81, 263), (1, 29), (10, 10)):
        interval = binomtest(good, count).proportion_ci(0.95, "wilson")
        assert wilson_interval(good, count) == pytest.approx((interval.low, interval.high))
    assert wilson_interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert estimate_yield(np.array([59.999, 60.0, 61.0, 10.0]), 60.0).share == 0.5


def test_builds_kinds_seeds_and_halves_differ_and_stay_as_they_are() -> None:
    """A build is the same alone or among others; no error is another one over again."""
    together, alone = draw(ALL, 5, range(7), M), draw(ALL, 5, range(4, 5), M)
    other = draw(ALL, 6, range(7), M)[0]
    a, b = together
    for name in NAMES:
        every = getattr(a, name)
        for half, single in zip(together, alone, strict=True):
            assert np.array_equal(getattr(half, name)[4:5], getattr(single, name)), name
        assert np.all(every[0] != every[1]), name
        assert np.all(every != getattr(other, name)), name
        assert np.all(every != getattr(b, name)), name
    alike = ("shell_shift", "shell_tilt", "camera_shift", "camera_tilt", "centre")
    drawn = np.concatenate([getattr(half, name).ravel() for half in together for name in alike])
    assert len(np.unique(drawn)) == len(drawn)


@pytest.mark.parametrize("kind", ["sphere_centre", "scale_isotropic", "camera_tilt", "facets"])
def test_without_one_kind_the_others_stay(kind: str) -> None:
    """Sensitivities then compare the same builds."""
    full, less = (
        draw(errors, 5, range(2), M)[0] for errors in (ALL, replace(ALL, **{kind: Error()}))
    )
    changed = [
        name for name in NAMES if not np.array_equal(getattr(full, name), getattr(less, name))
    ]
    goes_into = {"sphere_centre": "centre", "scale_isotropic": "scale", "facets": "facets"}
    assert changed == [goes_into.get(kind, kind)]


def test_errors_have_their_distributions() -> None:
    kinds = Errors(sphere_centre=Error(0.3, 0.1), camera_shift=Error(0.3, 0.1, "uniform"))
    drawn = draw(kinds, 1, range(400), 25)[0]
    centre, shift = drawn.centre, drawn.camera_shift
    assert centre.mean() == pytest.approx(0.1, abs=4 * 0.3 / np.sqrt(centre.size))
    assert centre.std() == pytest.approx(0.3, rel=4 / np.sqrt(2 * centre.size))
    assert np.abs(shift - 0.1).max() <= 0.3
    assert np.ptp(shift) > 0.59
    assert shift.std() == pytest.approx(0.3 / np.sqrt(3), rel=0.1)


def test_what_one_build_or_one_shell_has_in_common() -> None:
    a, b = draw(Errors(scale_axis=Error(0.01), coating=Error(0.02, 0.005)), 1, range(3), M)
    assert np.array_equal(a.scale, b.scale)
    assert len(np.unique(a.scale)) == 9
    assert np.all(a.radius == a.radius[:, :1])
    assert np.all(a.radius != b.radius)
    isotropic, other = draw(Errors(scale_isotropic=Error(0.01)), 1, range(3), M)
    assert np.all(isotropic.scale == isotropic.scale[:, :1])
    assert np.all(isotropic.scale != other.scale)
    thick, large = (
        draw(Errors(**{kind: Error(0, 0.03)}), 1, range(1), M)
        for kind in ("coating", "sphere_radius")
    )
    assert np.all(thick[0].radius == large[0].radius)
    assert np.all(thick[0].radius == 0.03)


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
