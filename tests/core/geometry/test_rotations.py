import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.rotations import even_angles, rotated, rotated_about_x, unit_circle
from tbcad.core.geometry.vectors import unit

RANDOM = np.random.default_rng(4)
VECTORS, AXES = RANDOM.normal(size=(20, 3)), unit(RANDOM.normal(size=(20, 3)))
ANGLES = RANDOM.uniform(-7, 7, 20)


def test_rotations_about_axes_against_quaternions() -> None:
    expected = Rotation.from_rotvec(ANGLES[:, None] * AXES).apply(VECTORS)
    assert rotated(VECTORS, AXES, ANGLES) == pytest.approx(expected, abs=1e-14)


def test_one_axis_and_angle_serve_all_vectors() -> None:
    expected = Rotation.from_rotvec([0.0, 0.0, 0.3]).apply(VECTORS)
    z = np.array([0.0, 0.0, 1.0])
    assert rotated(VECTORS, z, np.array(0.3)) == pytest.approx(expected, abs=1e-14)


def test_rotation_about_the_first_axis() -> None:
    turned = rotated_about_x(VECTORS, ANGLES)
    x = np.array([1.0, 0.0, 0.0])
    assert turned == pytest.approx(rotated(VECTORS, x, ANGLES), abs=1e-14)
    assert np.array_equal(turned[:, 0], VECTORS[:, 0])


def test_points_of_a_circle_divide_it_evenly_counter_clockwise() -> None:
    corners = unit_circle(even_angles(4))
    assert corners == pytest.approx(np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]), abs=1e-15)
