from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.prototype.balls.selection import MirrorGroups
from tbcad.prototype.balls.stops import (
    angle_between,
    min_stabbing_points,
    plan_stops,
    stop_requests,
)


def angle_by_vectors(polar: float, other: float, azimuth: float) -> float:
    a = np.array([np.cos(polar), np.sin(polar), 0])
    b = np.array([np.cos(other), *np.sin(other) * np.array([np.cos(azimuth), np.sin(azimuth)])])
    return float(2 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b)))


def fewest_by_exhaustive_search(low: np.ndarray, high: np.ndarray) -> int:
    """Some best points are upper ends of intervals."""
    for count in range(1, len(high) + 1):
        for points in combinations(high, count):
            hit = [(low <= point) & (point <= high) for point in points]
            if np.any(hit, axis=0).all():
                return count
    raise AssertionError


intervals = st.lists(
    st.tuples(st.floats(-1, 1), st.floats(0, 0.5))
    | st.tuples(st.integers(0, 9), st.integers(0, 4)),
    min_size=1,
    max_size=8,
)


@settings(max_examples=100)
@given(intervals)
def test_fewest_points_against_exhaustive_search(intervals: list[tuple[float, float]]) -> None:
    low = np.array([float(start) for start, _ in intervals])
    high = low + [float(length) for _, length in intervals]
    points, which = min_stabbing_points(low, high)
    assert len(points) == fewest_by_exhaustive_search(low, high)
    assert (np.diff(points) > 0).all()
    assert (low <= points[which]).all()
    assert (points[which] <= high).all()


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(0, 1), st.floats(-1, 1)), min_size=1, max_size=8))
def test_a_plan_has_the_fewest_stops_within_the_error(mirrors: list[tuple[int, float]]) -> None:
    """Limits of each mirror by spherical trigonometry: its ball moves on a circle of latitude."""
    polar, group_of = np.array([0.6, 1.4]), np.array([ball for ball, _ in mirrors])
    phi, error = np.array([azimuth for _, azimuth in mirrors]), 0.1
    groups = MirrorGroups(group_of, polar, np.ones(2))
    requests = stop_requests(groups, phi, error)
    cosine = (np.cos(error) - np.cos(polar) ** 2) / np.sin(polar) ** 2
    tolerance = np.arccos(cosine)[group_of]
    assert requests.tolerance == pytest.approx(tolerance, rel=1e-9)
    plan = plan_stops(groups, polar[group_of], requests, np.array([0.0, 0.3]))
    exact = phi - np.array([0.0, 0.3])[group_of]
    assert len(plan) == fewest_by_exhaustive_search(
        exact - requests.tolerance, exact + requests.tolerance
    )
    assert (plan.error <= error + 1e-9).all()


def test_a_stop_between_others_is_in_the_middle_of_its_mirrors() -> None:
    groups = MirrorGroups(np.zeros(4, dtype=np.int64), np.array([1.4]), np.ones(1))
    requests = stop_requests(groups, np.array([-1.0, 0.03, 0.05, 1.0]), 0.1)
    plan = plan_stops(groups, np.full(4, 1.4), requests, np.zeros(1))
    assert plan.angle[1] == pytest.approx(0.04)


@given(st.floats(0.1, 3), st.floats(0.1, 3), st.floats(-3, 3))
def test_angle_between_directions(polar: float, other: float, azimuth: float) -> None:
    angle = angle_between(np.array([polar]), np.array([other]), np.array([azimuth]))[0]
    assert angle == pytest.approx(angle_by_vectors(polar, other, azimuth), abs=1e-7)
