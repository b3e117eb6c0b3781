"""Rays through balls in closed form, and light through a field by sums in double precision."""

from dataclasses import dataclass

import numpy as np

from tbcad.light.reconstruction.field import Grid
from tbcad.light.reconstruction.rays import NO_FOOTPRINT, CapturedRays
from tbcad.types import Bools, Floats

RADIUS = 10.0  # of the capture sphere, mm
SOFTNESS = 0.01  # of the density, as the file's description has it


@dataclass(frozen=True)
class Ball:
    """A ball of one colour."""

    centre: tuple[float, float, float]
    radius: float
    colour: tuple[float, float, float]


def lines(count: int, seed: int = 0) -> tuple[Floats, Floats]:
    """Points on the capture sphere and unit vectors to other points of it, (n, 3) each."""
    ends = np.random.default_rng(seed).normal(size=(2, count, 3))
    ends *= RADIUS / np.linalg.norm(ends, axis=2, keepdims=True)
    ways = ends[1] - ends[0]
    return ends[0], ways / np.linalg.norm(ways, axis=1, keepdims=True)


def rays_of(balls: list[Ball], count: int, seed: int = 0) -> CapturedRays:
    """What rays in all directions see of balls before a black background."""
    entry, direction = lines(count, seed)
    nearest, colour = np.full(count, np.inf), np.zeros((count, 3), dtype=np.float32)
    for ball in balls:
        away = entry - ball.centre
        middle = -(away * direction).sum(axis=1)
        under = middle**2 - (away**2).sum(axis=1) + ball.radius**2
        at = np.where(under > 0, middle - np.sqrt(np.maximum(under, 0)), np.inf)
        colour[at < nearest] = ball.colour
        nearest = np.minimum(nearest, at)
    length = -2 * (entry * direction).sum(axis=1)
    columns = (entry, direction, length, colour, np.arange(count) % 50)
    return captured_along(*columns, capture_mm=2 * RADIUS)


def captured_along(*columns: Floats, capture_mm: float) -> CapturedRays:
    """Single rays that weigh alike: where they enter, direction, length, colour, mirror."""
    *floating, mirror = columns
    single = [values.astype(np.float32) for values in floating]
    weight = np.ones(len(mirror), dtype=np.float32)
    return CapturedRays(*single, mirror.astype(np.int32), weight, NO_FOOTPRINT, capture_mm)


def whole_cells(grid: Grid) -> Bools:
    """Cells that have all corners, one after the other, (n-1, n-1, n-1)."""
    there = np.zeros((grid.n,) * 3, dtype=bool)
    there[tuple(grid.place.T)] = True
    result = np.ones((grid.n - 1,) * 3, dtype=bool)
    for x, y, z in np.ndindex(*result.shape):
        result[x, y, z] = there[x : x + 2, y : y + 2, z : z + 2].all()
    return result


def in_whole_cells(grid: Grid, points: Floats) -> Bools:
    """Whether points (k, 3) lie in cells that have all corners."""
    at = (points + grid.width_mm / 2) / grid.pitch_mm
    inside = ((at >= 0) & (at < grid.n - 1)).all(axis=1)
    cell = np.clip(np.floor(at).astype(int), 0, grid.n - 2)
    return inside & whole_cells(grid)[tuple(cell.T)]


def light(
    grid: Grid, values: Floats, entry: Floats, direction: Floats, at: Floats, step: float
) -> Floats:
    """Red, green, blue, opacity of one ray whose samples (k,) are at these mm from its entry."""
    points = entry + at[:, None] * direction
    points = points[in_whole_cells(grid, points)]
    scaled = (points + grid.width_mm / 2) / grid.pitch_mm
    cell = np.floor(scaled).astype(int)
    lattice = np.zeros((grid.n,) * 3 + (values.shape[1],))
    lattice[tuple(grid.place.T)] = values
    found = np.zeros((len(points), values.shape[1]))
    for corner in np.ndindex(2, 2, 2):
        share = np.prod(np.where(corner, scaled - cell, 1 - (scaled - cell)), axis=1)
        found += share[:, None] * lattice[tuple((cell + corner).T)]
    colour = found[:, 1:4]
    if values.shape[1] > 4:
        colour = colour + found[:, 4:].reshape(-1, 3, 3) @ direction
    number = found[:, 0]
    clear = np.exp(-(number + np.sqrt(number**2 + SOFTNESS)) / 2 * step)
    before = np.cumprod(np.concatenate([[1.0], clear]))
    return np.append((before[:-1] * (1 - clear)) @ colour, 1 - before[-1])
