from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.prototype.balls.stops import angle_between, min_stabbing_points


def exhaustive(low: np.ndarray, high: np.ndarray) -> int:
    """Some best points are upper ends."""
    for count in range(1, len(high) + 1):
        for points in combinations(high, count):
            hit = [(low <= point) & (point <= high) for point in points]
            if np.any(hit, axis=0).all():
                return count
    raise AssertionError


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 8)), min_size=1, max_size=8))
def test_fewest_against_exhaustive_search(intervals: list[tuple[int, int]]) -> None:
    low = np.array([float(start) for start, _ in intervals])
    high = low + [float(length) for _, length in intervals]
    points, which = min_stabbing_points(low, high)
    assert len(points) == exhaustive(low, high)
    assert (low <= points[which]).all()
    assert (points[which] <= high).all()


def test_one_point_for_what_touches() -> None:
    points, which = min_stabbing_points(np.array([1.0, 0.0]), np.array([2.0, 1.0]))
    assert points.tolist() == [1.0]
    assert which.tolist() == [0, 0]


@given(st.floats(0.1, 3), st.floats(0.1, 3), st.floats(-3, 3))
def test_angle_between_directions(polar: float, other: float, azimuth: float) -> None:
    """By the vectors themselves."""
    a = np.array([np.cos(polar), np.sin(polar), 0])
    b = np.array([np.cos(other), *np.sin(other) * np.array([np.cos(azimuth), np.sin(azimuth)])])
    expected = 2 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b))
    found = angle_between(np.array([polar]), np.array([other]), np.array([azimuth]))[0]
    assert found == pytest.approx(expected, abs=1e-7)
