"""The point of reflection against the law; test_jacobian compares its derivatives."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.reflection import reflection_points
from tbcad.rig.calibration.estimate.jacobian import reflections


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
