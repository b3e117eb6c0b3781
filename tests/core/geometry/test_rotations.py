import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.rotations import even_angles, rotated, rotated_about_x, unit_circle
from tbcad.core.geometry.vectors import norm, unit

RANDOM = np.random.default_rng(4)
VECTORS, AXES = RANDOM.normal(size=(20, 3)), unit(RANDOM.normal(size=(20, 3)))
ANGLES = RANDOM.uniform(-7, 7, 20)


def test_rotations_about_axes_against_quaternions() -> None:
    expected = Rotation.from_rotvec(ANGLES[:, None] * AXES).apply(VECTORS)
    assert rotated(VECTORS, AXES, ANGLES) == pytest.approx(expected, abs=1e-14)


def test_rotation_about_the_first_axis() -> None:
    turned = rotated_about_x(VECTORS, ANGLES)
    x = np.array([1.0, 0.0, 0.0])
    assert turned == pytest.approx(rotated(VECTORS, x, ANGLES), abs=1e-14)
    assert np.array_equal(turned[:, 0], VECTORS[:, 0])


def test_points_of_a_circle_divide_it_evenly_counter_clockwise() -> None:
    corners = unit_circle(even_angles(4))
    assert corners == pytest.approx(np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]), abs=1e-15)


@pytest.mark.parametrize("shape", [(3,), (1, 3), (7, 300, 3), (2000, 2), (0, 3)])
@pytest.mark.parametrize("by_columns", [False, True])
def test_lengths_are_numpys_to_the_bit(shape: tuple[int, ...], by_columns: bool) -> None:
    random = np.random.default_rng(5)
    vectors = random.normal(size=shape) * 10 ** random.uniform(-9, 9, size=shape)
    vectors = np.asfortranarray(vectors) if by_columns else vectors
    assert np.array_equal(norm(vectors), np.linalg.norm(vectors, axis=-1))
