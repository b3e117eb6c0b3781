"""Sparse grids against loops over all of their nodes and cells."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.light.reconstruction.field import LONGEST_LEAP, SIDES, Grid, resampled
from tbcad.types import Bools
from tests.ray_fields import whole_cells

WIDTH = 6.0
masks = st.builds(
    lambda n, seed, share: np.random.default_rng(seed).random((n,) * 3) < share,
    st.integers(2, 7),
    st.integers(0, 10**6),
    st.floats(0, 0.3),
)
quickly = settings(max_examples=40)


@quickly
@given(masks)
def test_it_has_the_nodes_of_all_cells_with_a_wanted_one(wanted: Bools) -> None:
    grid = Grid.about(wanted, WIDTH)
    expected = np.zeros_like(wanted)
    for x, y, z in np.ndindex(*(np.array(wanted.shape) - 1)):
        if wanted[x : x + 2, y : y + 2, z : z + 2].any():
            expected[x : x + 2, y : y + 2, z : z + 2] = True
    assert np.array_equal(grid.place, np.argwhere(expected))
    assert np.array_equal(grid.row >= 0, expected)
    assert np.array_equal(grid.row[tuple(grid.place.T)], np.arange(len(grid)))
    assert np.array_equal(grid.dense(np.ones(len(grid), np.float32)) > 0, expected)


@quickly
@given(masks)
def test_leaps_are_distances_to_the_nearest_whole_cell(wanted: Bools) -> None:
    grid = Grid.about(wanted, WIDTH)
    whole = np.argwhere(whole_cells(grid))
    for cell in np.ndindex(*grid.leap.shape):
        away = np.abs(whole - cell).max(axis=1).min() if len(whole) else LONGEST_LEAP
        assert grid.leap[cell] == away


@quickly
@given(masks)
def test_neighbours_are_one_node_away(wanted: Bools) -> None:
    grid = Grid.about(wanted, WIDTH)
    rows = {tuple(place): k for k, place in enumerate(grid.place.tolist())}
    for k, place in enumerate(grid.place.tolist()):
        around = [rows.get(tuple(np.add(place, side).tolist()), -1) for side in SIDES]
        assert grid.neighbours[k].tolist() == around


def test_its_cube_is_about_the_origin() -> None:
    grid = Grid(5, WIDTH, np.array([[0, 0, 0], [2, 2, 2], [4, 4, 4]], np.uint16))
    assert grid.points == pytest.approx(np.array([[-3.0] * 3, [0.0] * 3, [3.0] * 3]))
    assert grid.pitch_mm == WIDTH / 4


def plane(n: int) -> np.ndarray:
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij")
    return (1 + x + 2 * y - 3 * z).astype(np.float32)


@pytest.mark.parametrize(("k", "n"), [(2, 9), (6, 6), (8, 44), (9, 4), (14, 86), (60, 100)])
def test_linear_values_stay_linear_on_other_lattices(k: int, n: int) -> None:
    assert np.abs(resampled(plane(k), n) - plane(n)).max() < 1e-5
    ends = np.array(list(product([0, n // 2, n - 1], repeat=3)), np.uint16)
    assert Grid(n, WIDTH, ends).sampled(plane(k)) == pytest.approx(
        plane(n)[tuple(ends.T)], abs=1e-5
    )
