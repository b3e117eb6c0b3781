import pickle
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tbcad.tolerancing.montecarlo.builds import (
    BUILDS_PER_BATCH,
    MonteCarloCase,
    ShellResult,
    estimate_yield,
    joined_results,
    simulate,
    wilson_interval,
)
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors

SOME = Errors(sphere_centre=Error(0.02), camera_shift=Error(0.1), scale_axis=Error(0.001))
BUILDS = 2 * BUILDS_PER_BATCH + 3
ARRAYS = ("coverage", "pixels", "angle", "offset")


@pytest.fixture(scope="module")
def case(halves: EdgeModels) -> MonteCarloCase:
    return MonteCarloCase(halves, SOME, 11)


@pytest.fixture(scope="module")
def result(case: MonteCarloCase) -> ShellResult:
    return simulate(case, BUILDS)


def same(one: ShellResult, two: ShellResult) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in ARRAYS)


def one_after_another(case: MonteCarloCase, batches: Sequence[range]) -> list[ShellResult]:
    return [case(batch) for batch in batches]


def backward(case: MonteCarloCase, batches: Sequence[range]) -> list[ShellResult]:
    """Three threads that take the batches last first."""
    with ThreadPoolExecutor(3) as pool:
        return list(pool.map(case, batches[::-1]))[::-1]


def pickled(case: MonteCarloCase, batches: Sequence[range]) -> list[ShellResult]:
    """As another process would have it."""
    return [pickle.loads(pickle.dumps(case))(batch) for batch in batches]


@pytest.mark.parametrize("run_batches", [one_after_another, backward, pickled])
def test_same_figures_with_any_workers(
    case: MonteCarloCase, result: ShellResult, run_batches: object
) -> None:
    assert same(simulate(case, BUILDS, run_batches), result)  # type: ignore[arg-type]


def test_same_figures_in_any_batches(
    case: MonteCarloCase, result: ShellResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tbcad.tolerancing.montecarlo.builds.BUILDS_PER_BATCH", 4)
    assert same(simulate(case, BUILDS), result)


def test_later_builds_continue_earlier_ones(case: MonteCarloCase, result: ShellResult) -> None:
    parts = [simulate(case, 5), simulate(case, BUILDS - 5, first=5)]
    assert same(joined_results(parts), result)


def test_another_seed_makes_other_builds(halves: EdgeModels, result: ShellResult) -> None:
    other = simulate(MonteCarloCase(halves, SOME, 12), BUILDS)
    assert not np.any(other.worst == result.worst)


def test_worst_and_quantiles(result: ShellResult) -> None:
    assert len(result) == BUILDS
    assert result.coverage.shape == result.pixels.shape == (BUILDS, 193)
    assert result.angle.shape == result.offset.shape == (BUILDS, 206)
    rows = np.arange(BUILDS)
    assert np.array_equal(result.coverage[rows, result.worst_camera], result.worst)
    assert np.all(result.worst[:, None] <= result.coverage)
    low, middle, high = result.quantiles([0, 0.5, 1])
    assert np.array_equal(low, result.coverage.min(axis=0))
    assert np.array_equal(high, result.coverage.max(axis=0))
    assert np.all((low < middle) & (middle < high))


def test_builds_without_errors_are_all_good(halves: EdgeModels) -> None:
    result = simulate(MonteCarloCase(halves, Errors(), 1), 2)
    assert result.offset.max() < 1e-9
    assert result.angle.max() < 1e-9
    assert estimate_yield(result.worst, 60.0).share == 1


@pytest.mark.parametrize(
    ("good", "count", "low", "high"),
    [
        (0, 10, 0.0, 0.2775),
        (5, 10, 0.2366, 0.7634),
        (81, 263, 0.2553, 0.3662),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_interval_of_wilson(good: int, count: int, low: float, high: float) -> None:
    """The last two: R. G. Newcombe, Stat. Med. 17 (1998) 857-872, table I, method 3."""
    assert wilson_interval(good, count) == pytest.approx((low, high), abs=5e-5)


def test_all_good_is_not_surely_all_good() -> None:
    low, high = wilson_interval(10, 10)
    assert (high, low) == (1.0, pytest.approx(1 - 0.2775, abs=5e-5))


def test_yield_counts_builds_that_just_reach_the_target() -> None:
    found = estimate_yield(np.array([59.999, 60.0, 61.0, 10.0]), 60.0)
    assert found.share == 0.5
    assert found.low < 0.5 < found.high
