"""Nearest points and rotation angles against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from tbcad_verify.mesh.vectors import (
    crossings,
    distances_to_segments,
    dot,
    nearest_on_lines,
    norm,
    rotation_angles,
)

RNG = np.random.default_rng(8)


def column(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float64)[:, None]


def test_nearest_points_of_lines() -> None:
    point, direction = RNG.normal(size=(2, 3, 50))
    nearest = nearest_on_lines(point, direction)
    np.testing.assert_allclose(dot(nearest, direction), 0, atol=1e-12)
    np.testing.assert_allclose(norm(np.cross(nearest - point, direction, axis=0)), 0, atol=1e-12)


@pytest.mark.parametrize(("first", "last", "x"), [(-9, 9, 0), (6, 9, 1), (-9, 4, -1)])
def test_nearest_points_of_a_part_of_a_line(first: float, last: float, x: float) -> None:
    nearest = nearest_on_lines(column(-5, 2, 0), column(1, 0, 0), first, last)
    np.testing.assert_array_equal(nearest, column(x, 2, 0))


def test_crossings_lie_on_line_and_plane() -> None:
    point, direction, normal = RNG.normal(size=(3, 3, 50))
    crossing = crossings(point, direction, normal)
    np.testing.assert_allclose(dot(crossing, normal), 0, atol=1e-11)
    off = np.cross(crossing - point, direction, axis=0)
    np.testing.assert_allclose(norm(off), 0, atol=1e-11)


@pytest.mark.parametrize(
    ("x", "distance"), [((1, 3, 4), 5), ((-3, 0, 4), 5), ((5, 4, 0), 5), ((2, 0, 0), 0)]
)
def test_distances_from_a_segment(x: tuple[float, ...], distance: float) -> None:
    found = distances_to_segments(column(*x), column(0, 0, 0), column(2, 0, 0))
    assert found[0] == pytest.approx(distance)


@pytest.mark.parametrize(("centre", "turns"), [((0, 0), 1), ((0.9, 0), 1), ((3, 0), 0)])
def test_rotation_angles_add_up_to_the_winding_number(
    centre: tuple[float, float], turns: int
) -> None:
    angle = 2 * np.pi * np.arange(40) / 40
    circle = np.stack([np.cos(angle) - centre[0], np.sin(angle) - centre[1], angle])
    axis = np.repeat(column(0, 0, 1), 40, axis=1)
    for path, sign in ((circle, 1), (circle[:, ::-1], -1)):
        found = rotation_angles(axis, path, np.roll(path, -1, axis=1)).sum()
        assert found == pytest.approx(2 * np.pi * turns * sign, abs=1e-12)
