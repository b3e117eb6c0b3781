from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.balls.placement import (
    SLACK,
    SOLVER_MARGIN,
    PlacementProblem,
    greedy_placement,
    min_swing_placement,
)


def problem(
    separation: np.ndarray, half: np.ndarray, limit: float = np.pi, max_swing: float = 2 * np.pi
) -> PlacementProblem:
    k = len(half)
    limits = np.full(k, limit)
    return PlacementProblem(separation, -half, half, -limits, limits, np.zeros(k), max_swing)


def min_swing_by_orders(separation: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """In each order, the longest chain of minimum differences between any two; the best order."""
    best = np.inf
    for order in permutations(range(len(low))):
        need = (high - low).max()
        for start in range(len(order)):
            chain = {order[start]: 0.0}
            for ball in order[start + 1 :]:
                chain[ball] = max(far + separation[other, ball] for other, far in chain.items())
                need = max(need, high[order[start]] - low[ball] + chain[ball])
        best = min(best, need)
    return float(best)


@st.composite
def problems(draw: st.DrawFn) -> PlacementProblem:
    k = draw(st.integers(1, 5))
    separation = np.zeros((k, k))
    for i in range(k):
        for j in range(i):
            separation[i, j] = separation[j, i] = draw(st.sampled_from([0.0, 0.1, 0.2, 0.35, 0.6]))
    low = np.array([draw(st.floats(-1.6, -0.2)) for _ in range(k)])
    high = np.array([draw(st.floats(0.2, 1.6)) for _ in range(k)])
    limit = np.full(k, 2 * np.pi)
    return PlacementProblem(separation, low, high, -limit, limit, np.zeros(k), 2 * np.pi)


@settings(max_examples=30)
@given(problems())
def test_swing_is_the_minimum_of_all_orders(case: PlacementProblem) -> None:
    found = min_swing_placement(case)
    expected = min_swing_by_orders(case.min_separation, case.served_low, case.served_high)
    assert found.swing == pytest.approx(expected, abs=3 * SLACK)
    assert found.swing_bound == pytest.approx(expected, abs=3 * SLACK)
    assert case.satisfied_by(found.azimuth)
    assert greedy_placement(case).swing > found.swing - 3 * SLACK


def test_balls_stay_clear_of_the_post() -> None:
    separation = np.full((4, 4), 0.4) - 0.4 * np.eye(4)
    half = np.full(4, 1.5)
    assert min_swing_placement(problem(separation, half)).swing == pytest.approx(4.2, abs=1e-4)
    # The same balls need azimuths 0.6 to either side and half a swing of 2.1 beside that.
    assert min_swing_placement(problem(separation, half, limit=2.7001)).swing == pytest.approx(
        4.2, abs=1e-3
    )
    with pytest.raises(SpecError, match=r"found no place for 4 balls.*post_diameter_mm smaller"):
        min_swing_placement(problem(separation, half, limit=2.69))


def test_swing_beyond_the_drive_is_refused() -> None:
    separation, half = np.array([[0, 0.5], [0.5, 0]]), np.array([1.0, 1.0])
    found = min_swing_placement(problem(separation, half, max_swing=2.51))
    assert found.swing == pytest.approx(2.5, abs=1e-4)
    with pytest.raises(SpecError, match=r"swing of 143 degrees.*max_swing_deg larger"):
        min_swing_placement(problem(separation, half, max_swing=2.49))
    assert 5 * SLACK < SOLVER_MARGIN


@pytest.mark.parametrize("count", [3, 300])
def test_too_many_balls_are_refused_without_a_search(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each 0.01 from each: the swing is a row of them, and what one ball serves."""
    separation = 0.01 * (1 - np.eye(count))
    row, half = 0.01 * (count - 1), np.full(count, 0.1)
    if count < 10:
        enough = problem(separation, half, max_swing=0.2 + row + 1e-4)
        assert min_swing_placement(enough).swing == pytest.approx(0.2 + row, abs=1e-4)
    monkeypatch.setattr("tbcad.prototype.balls.placement.milp", None)
    with pytest.raises(SpecError, match=f"no place for {count} balls"):
        min_swing_placement(problem(separation, half, max_swing=0.2 + row - 1e-2))


def test_of_equal_swings_the_minimum_outermost_azimuth() -> None:
    """The third ball, narrow and wide-edged, has room to 0.5 but is drawn in."""
    edge = np.array([0.0, 0.0, 0.4])
    separation = np.zeros((3, 3))
    limit = np.full(3, np.pi)
    low, high = -np.array([1.0, 1.0, 0.5]), np.array([1.0, 1.0, 0.5])
    found = min_swing_placement(PlacementProblem(separation, low, high, -limit, limit, edge, 6.0))
    assert found.outermost == pytest.approx(1.4, abs=1e-4)


@settings(max_examples=10)
@given(problems(), st.integers(0, 2**32 - 1))
def test_last_digits_of_the_limits_choose_nothing(case: PlacementProblem, seed: int) -> None:
    # They differ between computers, and most azimuths of such balls are free within an interval.
    digits = np.random.default_rng(seed).uniform(-1e-13, 1e-13, (2, len(case)))
    other = replace(
        case, served_low=case.served_low + digits[0], served_high=case.served_high + digits[1]
    )
    assume(np.array_equal(other.rounded().served_low, case.rounded().served_low))
    assume(np.array_equal(other.rounded().served_high, case.rounded().served_high))
    assert np.array_equal(min_swing_placement(other).azimuth, min_swing_placement(case).azimuth)
