"""Derivatives of a whole machine's highlights against finite differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes
from tests.rig.calibration.machines import drawn, small_machine, small_prior

PRIOR = small_prior(small_machine(stops=3))
STEP = 1e-3  # of the prior standard deviations


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
