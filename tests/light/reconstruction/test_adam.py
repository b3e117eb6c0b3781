"""A step of Adam: size, limits, smoothness by differences, and what stays untouched."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tbcad.light.reconstruction.gradient import (
    CORNER,
    MEMORY,
    ColumnSteps,
    Moments,
    adam,
    unbiased_size,
)
from tbcad.light.reconstruction.grid import Grid

GRID = Grid(3, 2.0, np.argwhere(np.ones((3, 3, 3), bool)).astype(np.uint16))
V = len(GRID)


def columns(smooth: float = 0.0, size: float = 0.1, limit: float = 9.0) -> ColumnSteps:
    values = (size, smooth, -limit, limit)
    return ColumnSteps(*[np.full(4, value, np.float32) for value in values])


def step(
    values: NDArray[np.float32], parts: NDArray[np.float32], how: ColumnSteps, sparse: float = 0.0
) -> tuple[NDArray[np.float32], Moments]:
    moments = Moments(np.zeros_like(values), np.zeros_like(values))
    changed = np.empty_like(values)
    adam((0, V), values, changed, parts, moments, GRID.neighbours, how, sparse)
    return changed, moments


def random_values(seed: int = 0) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(-2, 2, (V, 4)).astype(np.float32)


def test_the_first_step_has_its_size_against_the_gradient() -> None:
    values, gradient = random_values(), random_values(1)
    parts = np.stack([gradient / 4, gradient * 3 / 4]).astype(np.float32)
    how = columns()
    how = how._replace(size=unbiased_size(how.size, 1))
    changed, _ = step(values, parts, how)
    assert changed == pytest.approx(values - 0.1 * np.sign(gradient), abs=1e-4)
    assert not parts.any()


def test_values_stay_within_their_limits() -> None:
    gradient = random_values(1)
    changed, _ = step(random_values(), gradient[None].copy(), columns(size=100.0, limit=0.5))
    assert np.array_equal(changed, np.where(gradient > 0, np.float32(-0.5), np.float32(0.5)))


def test_smoothness_is_the_gradient_of_the_total_variation() -> None:
    values = random_values()
    gradient = np.full((1, V, 4), 1e-12, np.float32)
    _, moments = step(values, gradient, columns(smooth=1.0))
    found = moments.mean / (1 - MEMORY[0])

    def variation(x: NDArray[np.float64], column: int) -> float:
        lattice = x.reshape(3, 3, 3)
        apart = np.concatenate([np.diff(lattice, axis=axis).ravel() for axis in range(3)])
        return float((np.sqrt(apart**2 + CORNER) if column == 0 else apart**2 / 2).sum())

    for column in (0, 2):
        for node in range(0, V, 5):
            ahead, behind = values[:, column].astype(float), values[:, column].astype(float)
            ahead[node] += 1e-5
            behind[node] -= 1e-5
            expected = (variation(ahead, column) - variation(behind, column)) / 2e-5
            assert found[node, column] == pytest.approx(expected, abs=1e-4)


def test_sparsity_pulls_density_down_and_colours_nowhere() -> None:
    _, moments = step(random_values(), np.full((1, V, 4), 1e-12, np.float32), columns(), 0.01)
    assert (moments.mean[:, 0] > 0).all()
    assert np.abs(moments.mean[:, 1:]).max() < 1e-10


def test_nodes_without_any_gradient_stay() -> None:
    values = random_values()
    changed, _ = step(values, np.zeros((1, V, 4), np.float32), columns(smooth=1.0), 0.1)
    assert np.array_equal(changed, values)


def test_a_step_reads_no_node_that_it_has_changed() -> None:
    values = random_values()
    whole, _ = step(values, random_values(1)[None], columns(smooth=1.0))
    moments = Moments(np.zeros_like(values), np.zeros_like(values))
    parts, changed = random_values(1)[None], np.empty_like(values)
    for nodes in ((20, V), (0, 7), (7, 20)):
        adam(nodes, values, changed, parts, moments, GRID.neighbours, columns(smooth=1.0), 0.0)
    assert np.array_equal(changed, whole)
