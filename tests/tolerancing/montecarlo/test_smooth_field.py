"""Smooth random fields: their covariance, and what is left at very short and very long lengths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.core.geometry.vectors import perpendicular_axes
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels
from tbcad.tolerancing.montecarlo.warp import (
    MISSING_VARIANCE,
    SmoothField,
    covariance,
    pivots,
    smooth_field,
)

DRAWS = 20_000


def values(field: SmoothField, places: np.ndarray, draws: int = DRAWS) -> np.ndarray:
    numbers = np.random.default_rng(3).standard_normal((len(field), draws))
    return np.asarray(field.basis(places) @ numbers)


@pytest.mark.parametrize("length", [30.0, 50.0, 80.0])
def test_covariance_is_recovered_from_draws(halves: EdgeModels, length: float) -> None:
    """Within five standard errors, sqrt((1 + c^2) / draws), of the closed form c."""
    places = halves[0].apex
    found = np.cov(values(smooth_field(places, length), places), bias=True)
    wanted = np.exp(
        -(np.linalg.norm(places[:, None] - places[None], axis=2) ** 2) / (2 * length**2)
    )
    bound = 5 * np.sqrt((1 + wanted**2) / DRAWS) + MISSING_VARIANCE
    assert (np.abs(found - wanted) < bound).all()


@settings(max_examples=20)
@given(st.floats(20, 500), st.integers(0, 2**32 - 1))
def test_variance_misses_no_more_than_the_limit(length: float, seed: int) -> None:
    """At points that it does not follow from, too: of a half ellipsoid like a shell's."""
    points = np.random.default_rng(seed).standard_normal((300, 3))
    points *= np.array([90.0, 90.0, 60.0]) / np.linalg.norm(points, axis=1)[:, None]
    basis = smooth_field(points, length).basis(points)
    missing = 1 - np.sum(basis**2, axis=1)
    assert missing.min() > -1e-7
    assert missing.max() < 1.1 * MISSING_VARIANCE


def test_without_length_every_place_has_its_own(halves: EdgeModels) -> None:
    places = halves[0].apex
    field = smooth_field(places, 1e-3)
    assert len(field) == len(places)
    found = np.cov(values(field, places), bias=True)
    assert np.abs(found - np.eye(len(places))).max() < 5 * np.sqrt(2 / DRAWS)


def test_of_endless_length_all_places_have_one(halves: EdgeModels) -> None:
    places = halves[0].apex
    field = smooth_field(places, 1e7)
    assert len(field) == 1
    assert np.ptp(values(field, places, 100), axis=0).max() < 1e-6


def test_numbers_are_few(halves: EdgeModels) -> None:
    assert len(pivots(halves[0].apex, 80.0)) < 60 < len(halves[0].apex)


def test_slope_is_that_of_the_closed_form(halves: EdgeModels) -> None:
    """Root mean square 1 / length along the surface, on which the field is known."""
    place, step, length = halves[0].apex[[20]], 1e-3, 50.0
    field = smooth_field(halves[0].apex, length)
    for axis in step * perpendicular_axes(halves[0].normal[20]):
        change = field.basis(place + axis) - field.basis(place - axis)
        assert np.linalg.norm(change) / (2 * step) == pytest.approx(1 / length, rel=0.01)


def test_covariance_of_a_point_with_itself_is_one() -> None:
    point = np.array([[1.0, 2.0, 3.0]])
    assert covariance(point, point, 10.0) == 1
