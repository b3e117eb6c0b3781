"""Light along rays against closed forms and sums; gradients by differences; steps of Adam."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tbcad.light.reconstruction.field import Field, Grid
from tbcad.light.reconstruction.gradient import (
    CORNER,
    MEMORY,
    ColumnSteps,
    Moments,
    Pixels,
    _mixed,
    adam,
    add_gradient,
    unbiased_size,
)
from tbcad.light.reconstruction.marching import (
    GLOSSY,
    LEAST_LIGHT,
    LEAST_OPACITY,
    MATT,
    Medium,
    composited,
    march,
    spans,
)
from tbcad.types import Floats
from tests.ray_fields import RADIUS, in_whole_cells, light, lines

Singles = NDArray[np.float32]
WIDTH = 2 * RADIUS
GRID = Grid(3, 2.0, np.argwhere(np.ones((3, 3, 3), bool)).astype(np.uint16))
V = len(GRID)


def single(*values: object) -> list[Singles]:
    return [np.ascontiguousarray(value, dtype=np.float32) for value in values]


def cube(n: int) -> Grid:
    return Grid(n, WIDTH, np.argwhere(np.ones((n,) * 3, dtype=bool)).astype(np.uint16))


def filled(grid: Grid, number: Callable[[Floats], Floats]) -> Singles:
    """Values of nodes: a number by place, and one colour."""
    values = np.tile(np.float32([0, 0.8, 0.4, 0.2]), (len(grid), 1))
    values[:, 0] = number(grid.points)
    return values


def parallel(count: int, z: float = -8.0) -> tuple[Singles, Singles, Singles]:
    """Rays along z, close to the axis and not on a face of a cell."""
    entry = np.zeros((count, 3))
    entry[:, 0], entry[:, 1] = np.linspace(-0.9, 0.8, count), 0.13
    entry[:, 2] = np.linspace(z, z + 0.7, count)
    return tuple(single(entry, np.tile([0.0, 0, 1], (count, 1)), np.full(count, 16.0)))


def slab(number: float, step: float) -> Medium:
    """Cells from z = -3 to 2, all the same."""
    grid = cube(21)
    grid = Grid(21, WIDTH, grid.place[(grid.points[:, 2] >= -3) & (grid.points[:, 2] <= 2)])
    return Medium(
        WIDTH, step, grid.row, grid.leap, filled(grid, lambda at: np.full(len(at), number))
    )


@pytest.mark.parametrize("number", [0.02, 0.3, 0.9])
def test_a_uniform_slab_lets_through_the_exponential_of_its_thickness(number: float) -> None:
    step = 0.01
    entry, direction, length = parallel(8)
    found = composited(entry, direction, length, slab(number, step))
    density = (number + np.sqrt(number**2 + 0.01)) / 2
    opacity = 1 - np.exp(-density * 5)
    assert found[:, 3] == pytest.approx(np.full(8, opacity), abs=density * step)
    assert found[:, :3] == pytest.approx(found[:, 3:4] * [0.8, 0.4, 0.2], abs=1e-5)
    half = -3 - entry[:, 2] + np.log(2) / density
    if opacity > 0.5:
        assert found[:, 4] == pytest.approx(half, abs=2 * step)
    else:
        assert np.isnan(found[:, 4]).all()


def sparse(n: int, seed: int, columns: int, share: float = 0.4) -> Field:
    """Some blocks of nodes with values that are soft enough for all samples to count."""
    rng = np.random.default_rng(seed)
    grid = Grid.about(rng.random((n,) * 3) < share * rng.random() ** 3, WIDTH)
    values = rng.uniform(0, 1, (len(grid), columns))
    values[:, 0] = rng.uniform(-0.1, 0.5, len(grid))
    values[:, 4:] -= 0.5
    return Field(grid, values.astype(np.float32))


@settings(max_examples=40)
@given(st.integers(3, 12), st.integers(0, 10**6), st.sampled_from([MATT, GLOSSY]))
def test_leaps_pass_no_cell_that_has_all_corners(n: int, seed: int, columns: int) -> None:
    made = sparse(n, seed, columns)
    step = 0.37
    medium = Medium(WIDTH, step, made.grid.row, made.grid.leap, made.values)
    at, slot = np.empty((200, 4), np.float32), np.empty((200, 6), np.float32)
    for entry, direction in zip(*lines(10, seed), strict=True):
        length = -2 * entry @ direction
        found = march(*single(entry, direction), (0.0, length), 0.5, medium, at, slot)
        places = np.arange(0.5 * step, length, step)
        expected = light(made.grid, made.values, entry, direction, places, step)
        close = {"abs": float(LEAST_OPACITY * max(found[0], 1) + LEAST_LIGHT + 2e-5)}
        assert found[2:5] == pytest.approx(expected[:3], **close)
        assert 1 - found[1] == pytest.approx(expected[3], **close)


@settings(max_examples=30)
@given(st.integers(3, 12), st.integers(0, 10**6))
def test_spans_hold_all_that_a_ray_meets(n: int, seed: int) -> None:
    grid = sparse(n, seed, MATT).grid
    entry, direction = lines(12, seed)
    length = -2 * (entry * direction).sum(axis=1)
    first, last = spans(*single(entry, direction, length), grid.leap, WIDTH, 1)
    for k in range(len(entry)):
        at = np.arange(0, length[k], 0.01)
        met = at[in_whole_cells(grid, entry[k] + at[:, None] * direction[k])]
        if len(met):
            assert first[k] >= 0
            assert first[k] <= met[0] + 1e-4
            assert last[k] >= met[-1] - 1e-4
        elif not len(grid):
            assert first[k] < 0


def pixels_of(entry: Floats, direction: Floats, colour: Floats, **changes: Singles) -> Pixels:
    count = len(entry)
    length = -2 * (entry * direction).sum(axis=1)
    rays = single(entry, direction, np.zeros(count), length, colour, np.ones(count))
    rays += single(np.zeros((1, 4, 3)), np.zeros((1, 1, 2)))
    return Pixels(*rays)._replace(**changes)


def jitters(pixel: int, seed: int, kinds: int, count: int) -> tuple[int, list[float]]:
    """Pattern of the rays in a pixel, and where the first sample of each is, in steps."""
    state = _mixed(pixel, seed)
    kind, found = int(_mixed(pixel, 0)) % kinds, []
    for k in range(count):
        state = _mixed(state, k)
        found.append((int(state) >> 8) / (1 << 24))
    return kind, found


def doubled_loss(made: Field, values: Floats, pixels: Pixels, seed: int, step: float) -> float:
    """The loss whose half gradient `add_gradient` adds, by sums in double precision."""
    total = 0.0
    kinds, count = pixels.places.shape[:2]
    for i in range(len(pixels.entry)):
        kind, starts = jitters(i, seed, kinds, count)
        lights = []
        for k, start in enumerate(starts):
            x, y = pixels.places[kind, k].astype(float)
            print_of = pixels.footprint[i if len(pixels.footprint) > 1 else 0].astype(float)
            entry = pixels.entry[i].astype(float) + x * print_of[0] + y * print_of[1]
            direction = pixels.direction[i].astype(float) + x * print_of[2] + y * print_of[3]
            at = np.arange(pixels.first[i] + start * step, pixels.last[i], step)
            lights.append(light(made.grid, values, entry, direction, at, step)[:3])
        off = np.mean(lights, axis=0) - pixels.colour[i]
        total += float(pixels.weight[i] * off @ off)
    return total


@pytest.mark.parametrize("columns", [MATT, GLOSSY])
@pytest.mark.parametrize("count", [1, 3, 4])
def test_the_gradient_is_that_of_differences(columns: int, count: int) -> None:
    made, step, seed = sparse(7, 3, columns, 0.9), 0.9, 11
    rng = np.random.default_rng(5)
    entry, direction = lines(25, 8)
    wide = {}
    if count > 1:
        prints, places = rng.normal(size=(25, 4, 3)), rng.uniform(-0.5, 0.5, (3, count, 2))
        prints[:, 2:] *= 0.02
        wide = dict(zip(["footprint", "places"], single(prints, places), strict=True))
    weight = single(rng.uniform(0.2, 2, 25))[0]
    pixels = pixels_of(entry, direction, rng.uniform(0, 1, (25, 3)), weight=weight, **wide)
    gradient = np.zeros_like(made.values)
    medium = Medium(WIDTH, step, made.grid.row, made.grid.leap, made.values)
    loss, samples = add_gradient(np.arange(25), pixels, seed, medium, gradient)
    values = made.values.astype(float)
    assert samples > 50
    assert loss == pytest.approx(doubled_loss(made, values, pixels, seed, step), rel=2e-4)
    for column in (0, 1, 3, *range(4, columns, 4)):
        way = np.zeros_like(values)
        way[:, column] = rng.normal(size=len(values))
        ahead, behind = (
            doubled_loss(made, values + h * way, pixels, seed, step) for h in (1e-4, -1e-4)
        )
        expected = (ahead - behind) / 2e-4 / 2
        size = float(np.linalg.norm(gradient[:, column]))
        assert (gradient * way).sum() == pytest.approx(expected, abs=3e-3 * size), column


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
    stayed, _ = step(random_values(), np.zeros((1, V, 4), np.float32), columns(smooth=1.0), 0.1)
    assert np.array_equal(stayed, random_values())  # without any gradient
