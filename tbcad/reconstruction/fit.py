"""The fit of a field to rays: coarse to fine, by Adam on random batches.

Each batch is cut into a fixed number of parts, each with a gradient of its own, which are added in
their order: the result is the same, to the last bit, on any number of threads.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from math import ceil, cos, pi
from os import cpu_count

import numpy as np
from scipy import ndimage

from tbcad.reconstruction.adam import Columns, Moments, adam, unbiased_size
from tbcad.reconstruction.field import Field
from tbcad.reconstruction.grid import LONGEST_LEAP, Grid, resampled
from tbcad.reconstruction.hull import hull
from tbcad.reconstruction.marching import GLOSSY, MATT, Medium, Pixels, add_gradient, spans
from tbcad.reconstruction.rays import CapturedRays, Singles
from tbcad.simulate.parallel import chunks
from tbcad.types import Bools, Ints

PARTS = 8  # of a batch and of the nodes
FEWEST_STEPS = 40  # of an epoch
CENTRAL = np.zeros((1, 1, 2), dtype=np.float32)
FIRST_NUMBER, FIRST_COLOUR = 0.05, 0.4  # of the density; of the colours
NUMBERS = (-3.0, 60.0)
COLOURS = (-0.1, 1.1)
SLOPES = (-0.5, 0.5)
KEPT_NUMBER = 0.02  # a node near one of more than this goes on to the finer level
UNKNOWN = 0.3  # of the least number, that finer nodes outside of the coarser grid begin with
BORDER = 0.3  # of a mask between its nodes


@dataclass(frozen=True)
class Level:
    """One grid of the fit.

    Attributes:
        nodes: along each edge.
        epochs: how often each ray is used.
    """

    nodes: int
    epochs: int


@dataclass(frozen=True)
class Settings:
    """How a field is fitted.

    Attributes:
        levels: from coarse to fine.
        order: of the view dependence of colours, 0 or 1.
        smooth_density: weight of the total variation of the numbers, against the squared errors of
            as many rays as there are nodes.
        smooth_colour: weight of the squared differences of colours, likewise.
        sparse: weight of the density's logarithm, likewise.
        batch: rays of a step, at most.
        steps: of the numbers and of the colours, largest.
        last_steps: of both at the end.
        stride: between samples of a ray, in distances of nodes.
        places: of the rays of a pixel on the finest grid, (p, k, 2); coarser ones, which do not
            resolve a pixel, take its central ray.
        seed: of the random order.
    """

    levels: tuple[Level, ...] = (Level(60, 2), Level(100, 3), Level(144, 5))
    order: int = 0
    smooth_density: float = 5e-5
    smooth_colour: float = 5e-4
    sparse: float = 5e-4
    batch: int = 30_000
    steps: tuple[float, float] = (0.5, 0.03)
    last_steps: tuple[float, float] = (0.005, 0.0005)
    stride: float = 0.6
    places: Singles = field(default_factory=lambda: CENTRAL)
    seed: int = 0


@dataclass
class State:
    """A fit under way, after some epochs.

    Attributes:
        level: number of the present level.
        epoch: number of epochs of it that are done.
        grid: of that level.
        values: of its nodes, as of a field; two copies, of which a step reads one.
        moments: of Adam.
        step: number of steps of the level that are done.
        loss: mean squared error of the last epoch, summed over the colours.
    """

    level: int
    epoch: int
    grid: Grid
    values: Singles
    moments: Moments
    step: int = 0
    loss: float = np.nan

    def field(self) -> Field:
        """As a field."""
        return Field(self.grid, self.values)


def workers() -> ThreadPoolExecutor:
    """Threads for the parts."""
    return ThreadPoolExecutor(min(cpu_count() or 1, PARTS))


def fit(
    rays: CapturedRays, settings: Settings, used: Bools | None = None, state: State | None = None
) -> Iterator[State]:
    """Fit a field; each epoch's state is given before the next, which changes it.

    Args:
        rays: what was captured.
        settings: how.
        used: which rays it is fitted to, (n,); None: all.
        state: to go on from; None: from the hull.
    """
    with workers() as pool:
        state = state or first_state(hull(rays, pool), rays.capture_mm, settings)
        while state.level < len(settings.levels):
            yield from _epochs(rays, settings, used, state, pool)
            if state.level + 1 == len(settings.levels):
                return
            state = finer(state, settings)


def first_state(inside: Bools, capture_mm: float, settings: Settings, level: int = 0) -> State:
    """An even fog in a hull (k, k, k), on the grid of a level."""
    n = settings.levels[level].nodes
    grid = Grid.about(resampled(inside.astype(np.float32), n) > BORDER, capture_mm)
    values = np.zeros((len(grid), GLOSSY if settings.order else MATT), dtype=np.float32)
    values[:, 0], values[:, 1:MATT] = FIRST_NUMBER, FIRST_COLOUR
    return _begun(level, grid, values)


def finer(state: State, settings: Settings) -> State:
    """The present values on the next level's nodes, where something is or is near."""
    level = settings.levels[state.level + 1]
    coarse, values = state.grid, state.values
    number = coarse.dense(values[:, 0], 10 * NUMBERS[0])
    near = ndimage.binary_dilation(ndimage.maximum_filter(number, 3) > KEPT_NUMBER)
    grid = Grid.about(resampled(near.astype(np.float32), level.nodes) > BORDER, coarse.width_mm)
    known = np.maximum(grid.sampled(coarse.dense(np.ones(len(coarse), dtype=np.float32))), 0.05)
    columns: list[Singles] = [grid.sampled(coarse.dense(values[:, 0], UNKNOWN * NUMBERS[0]))]
    columns += [
        np.asarray(grid.sampled(coarse.dense(column)) / known, dtype=np.float32)
        for column in values[:, 1:].T
    ]
    return _begun(state.level + 1, grid, np.stack(columns, axis=1).astype(np.float32))


def _begun(level: int, grid: Grid, values: Singles) -> State:
    return State(level, 0, grid, values, Moments(np.zeros_like(values), np.zeros_like(values)))


def _epochs(
    rays: CapturedRays,
    settings: Settings,
    used: Bools | None,
    state: State,
    pool: ThreadPoolExecutor,
) -> Iterator[State]:
    """The epochs of a level that are left."""
    final = state.level + 1 == len(settings.levels)
    places = settings.places if final else CENTRAL
    first, last = all_spans(rays, state.grid, pool, rays.spread_mm(places))
    wanted = first >= 0 if used is None else (first >= 0) & used
    ray = np.flatnonzero(wanted)
    pixels = _pixels(rays, (first, last), places)
    epochs = settings.levels[state.level].epochs
    count = len(ray) // min(settings.batch, len(ray) // FEWEST_STEPS + 1) + 1
    parts = np.zeros((PARTS, *state.values.shape), dtype=np.float32)
    add_gradient(ray[:0], pixels, 0, medium_of(state.field(), settings.stride), parts[0])  # compile
    while state.epoch < epochs:
        random = np.random.default_rng([settings.seed, state.level, state.epoch])
        batches = np.array_split(random.permutation(ray), count)
        error = 0.0
        for k, batch in enumerate(batches):
            medium = medium_of(state.field(), settings.stride)
            error += _gradient(pixels, medium, batch, state.step, parts, pool)
            progress = (state.epoch * count + k + 1) / (epochs * count)
            _step(settings, state, progress, len(batch) / len(state.grid), parts, pool)
        state.epoch += 1
        state.loss = error / max(len(ray), 1)
        yield state


def all_spans(
    rays: CapturedRays, grid: Grid, pool: ThreadPoolExecutor, around_mm: float = 0.0
) -> tuple[Singles, Singles]:
    """Where all rays may meet something within that distance first and last, (n,) each."""
    leap, size = grid.leap, max(-(-len(rays) // PARTS), 1)
    near = min(1 + ceil(around_mm / grid.pitch_mm), LONGEST_LEAP - 1)

    def part(at: int) -> tuple[Singles, Singles]:
        here = slice(at, at + size)
        return spans(
            rays.entry[here], rays.direction[here], rays.length[here], leap, grid.width_mm, near
        )

    part(len(rays))  # compiled before any thread
    found = list(pool.map(part, range(0, len(rays), size)))
    first, last = (np.concatenate(one) for one in zip(*found, strict=True))
    return first, last


def _pixels(rays: CapturedRays, span: tuple[Singles, Singles], places: Singles) -> Pixels:
    return Pixels(
        rays.entry, rays.direction, *span, rays.colour, rays.weight, rays.footprint, places
    )


def _gradient(
    pixels: Pixels, medium: Medium, batch: Ints, seed: int, parts: Singles, pool: ThreadPoolExecutor
) -> float:
    """Fill `parts` with the gradient of a batch; return the sum of its squared errors."""
    shares = np.array_split(batch, PARTS)

    def part(k: int) -> float:
        return float(add_gradient(shares[k], pixels, seed, medium, parts[k])[0])

    return sum(pool.map(part, range(PARTS)))


def _step(
    settings: Settings,
    state: State,
    progress: float,
    share: float,
    parts: Singles,
    pool: ThreadPoolExecutor,
) -> None:
    """One step of Adam on the gradient in `parts`, which is empty afterwards.

    Args:
        settings: of the fit.
        state: changed.
        progress: share of the level's steps that are done.
        share: rays of the batch for each node.
        parts: of the gradient of the batch.
        pool: of threads.
    """
    state.step += 1
    columns = _columns(settings, state, progress, share)
    changed = np.empty_like(state.values)
    neighbours, count = state.grid.neighbours, len(state.grid)

    def part(nodes: slice) -> None:
        adam(
            (nodes.start, nodes.stop), state.values, changed, parts, state.moments, neighbours,
            columns, settings.sparse * share,
        )  # fmt: skip

    if state.step == 1:
        part(slice(0, 0))  # compiled before any thread
    list(pool.map(part, chunks(count, max(-(-count // PARTS), 1))))
    state.values = changed


def _columns(settings: Settings, state: State, progress: float, share: float) -> Columns:
    """What holds for the columns of the values."""
    final = state.level + 1 == len(settings.levels)
    slowing = 0.5 * (1 + cos(pi * progress)) if final else 1.0
    number, colour = (
        large * slowing + small
        for large, small in zip(settings.steps, settings.last_steps, strict=True)
    )
    rest = state.values.shape[1] - 1
    smooth = settings.smooth_colour * share
    return Columns(
        unbiased_size(_column(number, *[colour] * rest), state.step),
        _column(settings.smooth_density * share, *[smooth] * rest),
        _column(NUMBERS[0], *[COLOURS[0]] * 3, *[SLOPES[0]] * (rest - 3)),
        _column(NUMBERS[1], *[COLOURS[1]] * 3, *[SLOPES[1]] * (rest - 3)),
    )


def _column(*values: float) -> Singles:
    return np.array(values, dtype=np.float32)


def medium_of(made: Field, stride: float) -> Medium:
    """A field as the loops take it, with samples that many distances of nodes apart."""
    grid = made.grid
    return Medium(grid.width_mm, stride * grid.pitch_mm, grid.row, grid.leap, made.values)


def squared_error(rays: CapturedRays, which: Bools, made: Field, settings: Settings) -> float:
    """Mean squared error, summed over the colours, of some pixels (n,) by a field; NaN of none."""
    ray = np.flatnonzero(which)
    with workers() as pool:
        first, last = all_spans(rays, made.grid, pool, rays.spread_mm(settings.places))
        pixels = _pixels(rays, (first, last), settings.places)
        parts = np.zeros((PARTS, *made.values.shape), dtype=np.float32)
        medium = medium_of(made, settings.stride)
        add_gradient(ray[:0], pixels, 0, medium, parts[0])  # compile
        total = _gradient(pixels, medium, ray, 0, parts, pool)
    return total / len(ray) if len(ray) else float("nan")
