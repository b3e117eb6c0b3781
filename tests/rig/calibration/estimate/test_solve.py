"""Machines recovered from noisy highlights, with wrong ones among them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tbcad.errors import InputError
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.estimate.solve import estimate, outlier_limit
from tbcad.rig.machine.machine import Highlights
from tests.rig.calibration.machines import (
    NOISE_PX,
    drawn,
    every_highlight,
    small_machine,
    small_prior,
)

BUILDS = 8


@pytest.fixture(scope="module")
def prior() -> Prior:
    return small_prior(small_machine())


def test_errors_are_as_large_as_the_covariance_says(prior: Prior) -> None:
    """Over machines drawn from the prior, d^T C^-1 d is chi-squared: also the builds' sum."""
    total = 0.0
    for seed in range(BUILDS):
        values, machine = drawn(prior, seed)
        found = estimate(prior, every_highlight(machine, 100 + seed))
        off = found.values - values
        total += float(off @ (found.information @ off))
    low, high = chi2.ppf([0.001, 0.999], BUILDS * len(prior.free))
    assert low < total < high


def test_wrong_highlights_are_named_and_left_out(prior: Prior) -> None:
    _, machine = drawn(prior, 3)
    right = every_highlight(machine, 4)
    wrong = np.array([5, 80, 200, 333])
    pixel = right.pixel.copy()
    pixel[wrong] += np.array([[2.0, 0.0], [0.0, -40.0], [0.6, 0.6], [-300.0, 200.0]])
    found = estimate(prior, replace(right, pixel=pixel))
    assert np.flatnonzero(~found.used).tolist() == wrong.tolist()
    assert (found.sigmas_off[wrong] > outlier_limit(len(right))).all()
    exact = estimate(prior, right)
    assert np.abs(found.machine.centre - exact.machine.centre).max() < 0.05


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_noise_that_is_larger_than_said_is_found(prior: Prior, factor: float) -> None:
    _, machine = drawn(prior, 5)
    noisy = every_highlight(machine, 6, factor * NOISE_PX)
    found = estimate(prior, replace(noisy, sigma=np.full(len(noisy), NOISE_PX)))
    assert found.noise_factor == pytest.approx(factor, rel=0.1)
    assert np.sqrt((found.sigmas_off**2).mean() / 2) == pytest.approx(1, rel=0.15)
    assert found.used.all()


def test_two_series_have_offsets_of_their_own(prior: Prior) -> None:
    offsets = prior.first["angle_offset"]
    values = np.zeros(len(prior.free))
    values[np.searchsorted(prior.free, [offsets, offsets + 1])] = 3.0, -3.0
    machine = prior.machine(values)
    found = estimate(prior, every_highlight(machine, 7)).machine
    stops = len(machine.angle) // 2
    apart = found.angle[:stops] - found.angle[stops:]
    assert apart == pytest.approx(machine.angle[:stops] - machine.angle[stops:], abs=1e-3)
    assert np.abs(apart).min() > 5e-3


def test_nothing_to_calibrate_from(prior: Prior) -> None:
    none = np.zeros(0, dtype=np.int64)
    empty = Highlights(none, none, none, np.zeros((0, 2)), np.zeros(0))
    with pytest.raises(InputError, match="no highlights"):
        estimate(prior, empty)
