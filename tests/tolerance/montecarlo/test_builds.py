import pickle
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tbcad.tolerance.montecarlo.builds import (
    BATCH,
    MonteCarloCase,
    Result,
    Work,
    joined,
    simulate,
    wilson,
    yielded,
)
from tbcad.tolerance.montecarlo.draws import Error, Errors
from tbcad.tolerance.montecarlo.edge_model import EdgeModel

Halves = tuple[EdgeModel, EdgeModel]
SOME = Errors(sphere_centre=Error(0.02), camera_shift=Error(0.1), scale_axis=Error(0.001))
MACHINES = 2 * BATCH + 3
ARRAYS = ("coverage", "pixels", "angle", "offset")


@pytest.fixture(scope="module")
def task(halves: Halves) -> MonteCarloCase:
    return MonteCarloCase(halves, SOME, 11)


@pytest.fixture(scope="module")
def result(task: MonteCarloCase) -> Result:
    return simulate(task, MACHINES)


def same(one: Result, two: Result) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in ARRAYS)


def alone(work: Work, batches: Sequence[range]) -> list[Result]:
    return [work(batch) for batch in batches]


def backward(work: Work, batches: Sequence[range]) -> list[Result]:
    """Three threads that take the batches last first."""
    with ThreadPoolExecutor(3) as pool:
        return list(pool.map(work, batches[::-1]))[::-1]


def pickled(work: Work, batches: Sequence[range]) -> list[Result]:
    """As another process would have it."""
    return [pickle.loads(pickle.dumps(work))(batch) for batch in batches]


@pytest.mark.parametrize("each", [alone, backward, pickled])
def test_same_figures_whoever_works(task: MonteCarloCase, result: Result, each: object) -> None:
    assert same(simulate(task, MACHINES, each), result)  # type: ignore[arg-type]


def test_same_figures_in_whatever_batches(
    task: MonteCarloCase, result: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tbcad.tolerance.montecarlo.builds.BATCH", 4)
    assert same(simulate(task, MACHINES), result)


def test_later_machines_continue_earlier_ones(task: MonteCarloCase, result: Result) -> None:
    parts = [simulate(task, 5), simulate(task, MACHINES - 5, first=5)]
    assert same(joined(parts), result)


def test_another_seed_makes_other_machines(halves: Halves, result: Result) -> None:
    other = simulate(MonteCarloCase(halves, SOME, 12), MACHINES)
    assert not np.any(other.worst == result.worst)


def test_worst_and_quantiles(result: Result) -> None:
    assert len(result) == MACHINES
    assert result.coverage.shape == result.pixels.shape == (MACHINES, 193)
    assert result.angle.shape == result.offset.shape == (MACHINES, 206)
    rows = np.arange(MACHINES)
    assert np.array_equal(result.coverage[rows, result.worst_camera], result.worst)
    assert np.all(result.worst[:, None] <= result.coverage)
    low, middle, high = result.quantiles([0, 0.5, 1])
    assert np.array_equal(low, result.coverage.min(axis=0))
    assert np.array_equal(high, result.coverage.max(axis=0))
    assert np.all((low < middle) & (middle < high))


def test_machines_without_errors_all_do(halves: Halves) -> None:
    result = simulate(MonteCarloCase(halves, Errors(), 1), 2)
    assert result.offset.max() < 1e-9
    assert result.angle.max() < 1e-9
    assert yielded(result.worst, 60.0).share == 1


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
    assert wilson(good, count) == pytest.approx((low, high), abs=5e-5)


def test_all_good_is_not_surely_all_good() -> None:
    low, high = wilson(10, 10)
    assert (high, low) == (1.0, pytest.approx(1 - 0.2775, abs=5e-5))


def test_yield_counts_machines_that_just_reach_the_target() -> None:
    found = yielded(np.array([59.999, 60.0, 61.0, 10.0]), 60.0)
    assert found.share == 0.5
    assert found.low < 0.5 < found.high
