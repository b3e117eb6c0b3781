"""Machines recovered from noisy highlights, with wrong ones among them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.reflection import reflection_points
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes, reflections
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.estimate.solve import estimate, outlier_limit
from tbcad.rig.calibration.priors import shell_prior
from tbcad.rig.machine.designed import designed_shell
from tbcad.rig.machine.machine import Highlights
from tbcad.tolerancing.process.process import load_process, process_errors
from tests.rig.calibration.machines import (
    LEDS,
    NOISE_PX,
    drawn,
    every_highlight,
    small_machine,
    small_prior,
)

BUILDS = 8
PRIOR = small_prior(small_machine(stops=3))
STEP = 1e-3  # of the prior standard deviations
HIGHLIGHTS = 4


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


def _case(seed: int, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    pinhole, light = np.array([100.0, 0.0, -100.0]), rng.uniform(-25, 25, size=(5, 3))
    apex = unit(rng.normal(loc=(0, 0, 1.5), size=(5, 3))) * 150
    normal = unit(unit(light - apex) + unit(pinhole - apex) + 0.05 * rng.normal(size=(5, 3)))
    return apex - radius * normal, np.full(5, radius), light, pinhole


@given(st.integers(0, 2**32 - 1), st.floats(1, 2000))
@example(3008991829, 246.0)  # Newton's steps from the bisector at the centre go astray
@settings(max_examples=40)
def test_the_point_is_that_of_the_law_of_reflection(seed: int, radius: float) -> None:
    case = _case(seed, radius)
    assert reflections(*case).point == pytest.approx(reflection_points(*case), abs=1e-8)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=2)
def test_slopes_are_those_of_finite_differences(seed: int) -> None:
    values, machine = drawn(PRIOR, seed)
    shape = (len(machine.angle), len(machine.radius), len(machine.leds))
    picked = [one.ravel()[::7] for one in np.indices(shape)]
    pixel, slopes = highlights_with_slopes(PRIOR, values, *picked)
    assert pixel == pytest.approx(machine.highlights(*picked), abs=1e-8)
    dense = slopes.toarray()
    for k, step in enumerate(STEP * np.eye(len(values))):
        ends = [PRIOR.machine(values + sign * step).highlights(*picked) for sign in (-1, 1)]
        slope = (ends[1] - ends[0]).ravel() / (2 * STEP)
        assert dense[:, k] == pytest.approx(slope, rel=1e-6, abs=1e-5), k


def test_errors_of_a_shell_are_as_large_as_the_covariance_says(small_design: MirrorDesign) -> None:
    machine = designed_shell(reflectors(small_design)[0], LEDS)
    prior = shell_prior(machine, process_errors(load_process("sla")))
    values, true = drawn(prior, 2)
    found = estimate(prior, every_highlight(true, 12))
    off = found.values - values
    low, high = chi2.ppf([0.001, 0.999], len(prior.free))
    assert low < off @ (found.information @ off) < high
    assert len(found.highlights) <= HIGHLIGHTS * len(prior.mean.radius)
