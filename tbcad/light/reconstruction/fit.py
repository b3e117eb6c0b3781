"""The fit of a field to rays: coarse to fine, by Adam on random batches; and the choice of fits.

Each batch is cut into a fixed number of parts, each with a gradient of its own, which are added in
their order: the result is the same, to the last bit, on any number of threads.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, cos, pi
from typing import TypeAlias

import numpy as np

from tbcad.common.schedule import one_client, run_units
from tbcad.light.reconstruction.field import LONGEST_LEAP, Field, Grid
from tbcad.light.reconstruction.gradient import (
    ColumnSteps,
    Pixels,
    adam,
    add_gradient,
    unbiased_size,
)
from tbcad.light.reconstruction.marching import Medium, Singles, spans
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.reconstruction.start import (
    CENTRAL,
    NUMBERS,
    Level,
    Settings,
    State,
    finer,
    first_state,
    hull,
)
from tbcad.light.simulate.parallel import chunks, first_then_threads, in_threads, over_chunks
from tbcad.types import Bools, Ints, Progress

PARTS = 8  # of a batch and of the nodes
FEWEST_STEPS = 40  # of an epoch
COLOURS = (-0.1, 1.1)
SLOPES = (-0.5, 0.5)
EVERY = 20  # one mirror of so many is held out
LEVELS = (Level(48, 1), Level(72, 2))  # of a trial
FACTOR = 4.0  # between weights that are tried
MOST_STEPS = 3  # of a walk
LEAST_GAIN = 0.01  # of the loss, that a step must bring
ORDER_GAIN = 0.05  # likewise, and view dependence, which also costs twice the time


def fit(
    rays: CapturedRays, settings: Settings, used: Bools | None = None, state: State | None = None
) -> Iterator[State]:
    """Fit a field; each epoch's state is given before the next, which changes it.

    It is fitted to used rays (n,), None: all, and goes on from a state, None: from the hull.
    """
    state = state or first_state(hull(rays), rays.capture_mm, settings)
    while state.level < len(settings.levels):
        yield from _epochs(rays, settings, used, state)
        if state.level + 1 == len(settings.levels):
            return
        state = finer(state, settings)


def _epochs(
    rays: CapturedRays, settings: Settings, used: Bools | None, state: State
) -> Iterator[State]:
    """The epochs of a level that are left."""
    final = state.level + 1 == len(settings.levels)
    places = settings.places if final else CENTRAL
    pixels = _pixels(rays, state.grid, places)
    ray = np.flatnonzero(pixels.first >= 0 if used is None else (pixels.first >= 0) & used)
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
            error += _gradient(pixels, medium, batch, state.step, parts)
            progress = (state.epoch * count + k + 1) / (epochs * count)
            _step(settings, state, progress, len(batch) / len(state.grid), parts)
        state.epoch += 1
        state.loss = error / max(len(ray), 1)
        yield state


def all_spans(rays: CapturedRays, grid: Grid, around_mm: float = 0.0) -> tuple[Singles, Singles]:
    """Where all rays may meet something within that distance first and last, (n,) each."""
    leap = grid.leap
    near = min(1 + ceil(around_mm / grid.pitch_mm), LONGEST_LEAP - 1)

    def part(here: slice) -> Singles:
        some = rays.entry[here], rays.direction[here], rays.length[here]
        return np.stack(spans(*some, leap, grid.width_mm, near), axis=1)

    found = over_chunks(part, len(rays), max(-(-len(rays) // PARTS), 1))
    return np.ascontiguousarray(found[:, 0]), np.ascontiguousarray(found[:, 1])


def _pixels(rays: CapturedRays, grid: Grid, places: Singles) -> Pixels:
    """Rays as the loops take them, from where they come near to a grid's nodes."""
    span = all_spans(rays, grid, rays.spread_mm(places))
    return Pixels(
        rays.entry, rays.direction, *span, rays.colour, rays.weight, rays.footprint, places
    )


def _gradient(pixels: Pixels, medium: Medium, batch: Ints, seed: int, parts: Singles) -> float:
    """Fill `parts` with the gradient of a batch; return the sum of its squared errors."""
    shares = np.array_split(batch, PARTS)

    def part(k: int) -> float:
        return float(add_gradient(shares[k], pixels, seed, medium, parts[k])[0])

    return sum(in_threads(part, range(PARTS)))


def _step(settings: Settings, state: State, progress: float, share: float, parts: Singles) -> None:
    """One step of Adam on the gradient in `parts`, which is empty afterwards; the state is changed.

    Progress is the share of the level's steps that are done, share the rays of a batch for a node.
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

    first_then_threads(part, [slice(0, 0), *chunks(count, max(-(-count // PARTS), 1))])
    state.values = changed


def _columns(settings: Settings, state: State, progress: float, share: float) -> ColumnSteps:
    """Settings of the columns of the values."""
    final = state.level + 1 == len(settings.levels)
    slowing = 0.5 * (1 + cos(pi * progress)) if final else 1.0
    number, colour = (
        large * slowing + small
        for large, small in zip(settings.steps, settings.last_steps, strict=True)
    )
    rest = state.values.shape[1] - 1
    smooth = settings.smooth_colour * share
    return ColumnSteps(
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
    pixels = _pixels(rays, made.grid, settings.places)
    parts = np.zeros((PARTS, *made.values.shape), dtype=np.float32)
    medium = medium_of(made, settings.stride)
    add_gradient(ray[:0], pixels, 0, medium, parts[0])  # compile
    total = _gradient(pixels, medium, ray, 0, parts)
    return total / len(ray) if len(ray) else float("nan")


@dataclass(frozen=True)
class Trial:
    """A fit that was tried."""

    settings: Settings  # its settings
    loss: float  # mean squared error of held-out rays, summed over the colours


def held_out(rays: CapturedRays) -> Bools:
    """Rays (n,) of every 20th mirror."""
    return np.asarray(rays.mirror % EVERY == EVERY // 2)


def chosen(
    rays: CapturedRays,
    inside: Bools,
    settings: Settings,
    orders: tuple[int, ...],
    progress: Progress,
    scheduler: str | None = None,
) -> tuple[Settings, list[Trial]]:
    """Choose the weights of smoothness and sparsity, and the order of view dependence, by trials.

    All weights are changed by one factor, as long as held-out rays are predicted better by a coarse
    fit in the rays' hull; then orders are compared, of which the first is begun with. Workers of a
    Dask scheduler try at the same time what may be asked for next; the choice is the same.
    InputError: as of `run_units`.
    """
    coarse, work = replace(settings, levels=LEVELS), partial(held_out_loss, rays, inside)
    known: dict[_Key, float] = {}
    with one_client(scheduler) as client:
        places = len(client.nthreads()) if client else 1
        while wanted := _ahead(coarse, orders, known, places):
            progress(f"trial {len(known) + 1}: weights and view dependence by held-out mirrors")
            losses = run_units(work, wanted, scheduler) if scheduler else map(work, wanted)
            known.update(zip(map(_key, wanted), losses, strict=True))
    trials: list[Trial] = []

    def tried(wanted: Settings) -> Trial:
        trials.append(Trial(wanted, known[_key(wanted)]))
        return trials[-1]

    best = _choice(tried, coarse, orders)
    return replace(best.settings, levels=settings.levels), trials


_Key: TypeAlias = tuple[int, float]


def _key(settings: Settings) -> _Key:
    """All that differs between trials."""
    return settings.order, settings.sparse


class _Unknown(Exception):
    """A trial that was not made yet."""


def _ahead(
    settings: Settings, orders: tuple[int, ...], known: Mapping[_Key, float], most: int
) -> list[Settings]:
    """The trial that the choice needs next, and those that it may need after it: the likely first.

    None where it needs no more.
    """
    wanted: dict[_Key, Settings] = {}
    guesses = deque([dict(known)])
    while guesses and len(wanted) < most:
        losses = guesses.popleft()

        def tried(asked: Settings, losses: dict[_Key, float] = losses) -> Trial:
            if _key(asked) not in losses:
                raise _Unknown(asked)
            return Trial(asked, losses[_key(asked)])

        try:
            _choice(tried, settings, orders)
        except _Unknown as missing:
            (asked,) = missing.args
            wanted.setdefault(_key(asked), asked)
            least = min(losses.values(), default=1.0)  # it may be worse, or better than all
            guesses += [losses | {_key(asked): loss} for loss in (2 * least, least / 2)]
    return [*wanted.values()]


def _choice(
    tried: Callable[[Settings], Trial], settings: Settings, orders: tuple[int, ...]
) -> Trial:
    best = _best_weight(tried, replace(settings, order=orders[0]))
    for order in orders[1:]:
        other = tried(replace(best.settings, order=order))
        best = other if other.loss < (1 - ORDER_GAIN) * best.loss else best
    return best


def _best_weight(tried: Callable[[Settings], Trial], settings: Settings) -> Trial:
    """Walk to smaller weights while that helps; if it never does, to larger ones likewise."""
    begun = tried(settings)
    best = _walk(tried, begun, 1 / FACTOR)
    return best if best is not begun else _walk(tried, begun, FACTOR)


def _walk(tried: Callable[[Settings], Trial], best: Trial, factor: float) -> Trial:
    for _ in range(MOST_STEPS):
        other = tried(weighted(best.settings, factor))
        if other.loss > (1 - LEAST_GAIN) * best.loss:
            break
        best = other
    return best


def weighted(settings: Settings, factor: float) -> Settings:
    """The same with all weights times a factor."""
    names = ("smooth_density", "smooth_colour", "sparse")
    return replace(settings, **{name: getattr(settings, name) * factor for name in names})


def held_out_loss(rays: CapturedRays, inside: Bools, settings: Settings) -> float:
    """Mean squared error, summed over the colours, of held-out rays by a fit to all others."""
    held = held_out(rays)
    *_, last = fit(rays, settings, ~held, first_state(inside, rays.capture_mm, settings))
    return squared_error(rays, held, last.field(), settings)
