"""Derivatives of highlights against finite differences, and the point against the law."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.reflection import reflection_points
from tbcad.rig.calibration.estimate.jacobian import projection, reflections
from tests.rig.machine.test_machine import CAMERA

STEP = 1e-4
ACCURACY = 1e-7  # of central differences with this step, of lengths of 100 mm


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


@given(st.integers(0, 2**32 - 1), st.floats(2, 200))
@settings(max_examples=40)
def test_derivatives_are_those_of_finite_differences(seed: int, radius: float) -> None:
    case = _case(seed, radius)
    found = reflections(*case)
    for place, derivative in ((0, found.by_centre), (2, found.by_light), (3, found.by_pinhole)):
        for k, axis in enumerate(np.eye(3)):
            assert derivative[:, :, k] == pytest.approx(_slope(case, place, axis), abs=ACCURACY)
    assert found.by_radius == pytest.approx(_slope(case, 1, np.ones(5)), abs=ACCURACY)


def _slope(case: tuple[np.ndarray, ...], place: int, direction: np.ndarray) -> np.ndarray:
    ends = []
    for step in (-STEP, STEP):
        moved = list(case)
        moved[place] = moved[place] + step * direction
        ends.append(reflections(*moved).point)
    return (ends[1] - ends[0]) / (2 * STEP)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_slopes_of_the_lens_are_those_of_finite_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = np.column_stack([rng.uniform(-80, 80, size=(6, 2)), rng.uniform(100, 300, size=6)])
    values = np.concatenate([CAMERA.focal, CAMERA.principal, rng.normal(scale=0.02, size=5)])
    pixel, by_point, by_lens = projection(_camera(values), image)
    world = image @ CAMERA.axes + CAMERA.pinhole
    assert pixel == pytest.approx(_camera(values).project(world), abs=1e-9)
    for k, step in enumerate(STEP * np.eye(3)):
        ends = [projection(_camera(values), image + sign * step)[0] for sign in (-1, 1)]
        assert by_point[:, :, k] == pytest.approx((ends[1] - ends[0]) / (2 * STEP), abs=1e-5)
    for k, step in enumerate(STEP * np.eye(9)):
        ends = [projection(_camera(values + sign * step), image)[0] for sign in (-1, 1)]
        assert by_lens[:, :, k] == pytest.approx((ends[1] - ends[0]) / (2 * STEP), abs=1e-5)


def _camera(values: np.ndarray) -> LensCamera:
    return replace(CAMERA, focal=values[:2], principal=values[2:4], distortion=values[4:])
