"""Differential evolution over places, each judged once: the same on any number of cores."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from tbcad.common.atomic_files import replace_files
from tbcad.common.schedule import run_units
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import spec_dict
from tbcad.errors import InputError
from tbcad.optimizing.candidate import (
    DesignCandidate,
    Figures,
    MachineLimits,
    Place,
    bounds,
    evaluate,
    place_of,
    read_store,
    rounded,
    store_bytes,
)
from tbcad.options.designs import Objective, OptimizeOptions
from tbcad.types import Floats

POPULATION = 40  # places of a generation: eight for each variable
SEED = 0
IMPOSSIBLE = 1e6  # value of a place where nothing can be made
BEYOND = 1e2  # value of a place beyond the limits: more than any within
EXCESS = 1e2  # value of a relative excess of 1 over a limit
MOST = 0.7  # weight that one objective has at least, where it counts most
ANY_SIZE = MachineLimits(np.inf, np.inf)

LOSSES: dict[Objective, Callable[[Figures], float]] = {
    "minimum": lambda one: -np.log(max(one.minimum_px, 1)),
    "pixels": lambda one: -one.mean_log_px,
    "evenness": lambda one: np.log(one.variation),
    "ssim": lambda one: np.log(1 - (one.ssim or 0.0)),
    "size": lambda one: np.log(one.size_mm),
}
"""What is the smaller the better, as a logarithm; of SSIM what is missing to 1."""


@dataclass(frozen=True)
class SearchResult:
    """What a search found."""

    start: DesignCandidate
    limits: MachineLimits
    best: DesignCandidate
    candidates: tuple[DesignCandidate, ...]  # all that were judged, in the order in which they were
    on_front: tuple[bool, ...]  # which no other within the limits betters in all objectives


def search(spec: Spec, asked: OptimizeOptions, store: Path | None = None) -> SearchResult:
    """Search a better place of camera and ellipsoid.

    The store, a file of judgements (JSON lines), is read when it exists, and written after every
    generation, so that a search that was stopped goes on. InputError if the first design cannot be
    made, or the store is of another design.
    """
    judged = read_store(store, _key(spec, asked)) if store else {}
    judge = partial(_judge, spec, asked, judged, store)
    start = judge(ANY_SIZE, [place_of(spec)])[0]
    if start.figures is None:
        raise InputError(f"the design to begin from cannot be made: {start.reason}")
    limits = MachineLimits(
        asked.max_size_mm or start.figures.size_mm,
        asked.max_view_angle_deg or start.figures.view_angle_deg,
    )
    value = partial(_value, asked.aims, limits, start.figures)
    every = weightings(len(asked.aims)) if asked.front else [_even(len(asked.aims))]
    generations = max(1, asked.candidates // len(every) // POPULATION - 1)
    box = Bounds(*np.transpose(bounds(spec, limits.size_mm)))
    for weights in every:
        _evolve(box, start.place, generations, partial(judge, limits), partial(value, weights))
    candidates = tuple(judged.values())
    losses = _losses(asked.aims, limits, start.figures, candidates)
    best = min(candidates, key=partial(value, _even(len(asked.aims))))
    return SearchResult(start, limits, best, candidates, _front(losses))


def _key(spec: Spec, asked: OptimizeOptions) -> str:
    """What judgements depend on: those of another design are of no use."""
    text = json.dumps(spec_dict(spec), sort_keys=True)
    return sha256((text + ("field" if asked.method == "field" else "")).encode()).hexdigest()


def weightings(objectives: int) -> list[Floats]:
    """How much each of k objectives counts, in one search after the other, (k,) each.

    First all alike, then one after the other most: places between the extremes of a Pareto front,
    and near them.
    """
    even = _even(objectives)
    if objectives == 1:
        return [even]
    return [even, *(even * (1 - MOST) + MOST * np.eye(objectives))]


def _even(objectives: int) -> Floats:
    return np.full(objectives, 1 / objectives)


def _evolve(
    box: Bounds,
    start: Place,
    generations: int,
    judge: Callable[[Sequence[Place]], list[DesignCandidate]],
    value: Callable[[DesignCandidate], float],
) -> None:
    """Judge generations of places, each nearer to the lowest value."""
    differential_evolution(
        _never_called,
        box,
        x0=np.array(start),
        maxiter=generations,
        popsize=POPULATION // len(start),
        tol=0,
        rng=np.random.default_rng(SEED),
        polish=False,
        updating="deferred",
        workers=lambda _, places: [*map(value, judge([rounded(np.array(p)) for p in places]))],
    )


def _never_called(place: Floats) -> float:
    """A generation is judged as a whole, by `workers`."""
    raise AssertionError(place)


def _value(
    objectives: Sequence[Objective],
    limits: MachineLimits,
    start: Figures,
    weights: Floats,
    one: DesignCandidate,
) -> float:
    """What is minimised: the weighted mean of all objectives, relative to the first design."""
    if one.figures is None:
        return IMPOSSIBLE
    if excess := limits.excess(one.figures):
        return BEYOND + EXCESS * excess
    if _lacks(objectives, one.figures):
        return IMPOSSIBLE
    return float(weights @ objective_losses(objectives, start, one.figures))


def objective_losses(objectives: Sequence[Objective], start: Figures, one: Figures) -> list[float]:
    """By how much a design is worse than the first, for each objective: logarithms of ratios."""
    return [float(LOSSES[name](one) - LOSSES[name](start)) for name in objectives]


def _judge(
    spec: Spec,
    asked: OptimizeOptions,
    judged: dict[Place, DesignCandidate],
    store: Path | None,
    limits: MachineLimits,
    places: Sequence[Place],
) -> list[DesignCandidate]:
    """Candidates at places, of which only those are worked out that the store does not have."""
    wanted = limits if "ssim" in asked.aims else None
    new = [p for p in dict.fromkeys(places) if _is_open(asked.aims, limits, judged.get(p))]
    work = partial(evaluate, spec, wanted, method=asked.method or "nearest")
    for one in run_units(work, new, asked.scheduler):
        judged[one.place] = one
    if store and new:
        replace_files(store.parent, {store.name: store_bytes(_key(spec, asked), judged)})
    asked.detail(f"{len(judged)} of about {asked.candidates} candidates")
    return [judged[place] for place in places]


def _is_open(
    objectives: Sequence[Objective], limits: MachineLimits, known: DesignCandidate | None
) -> bool:
    """Whether a candidate has to be judged, or judged again."""
    if known is None or known.figures is None:
        return known is None
    return _lacks(objectives, known.figures) and limits.excess(known.figures) == 0


def _lacks(objectives: Sequence[Objective], figures: Figures) -> bool:
    """Whether an earlier search, of other aims, did not measure what is an aim now."""
    return "ssim" in objectives and figures.ssim is None


def _losses(
    objectives: Sequence[Objective],
    limits: MachineLimits,
    start: Figures,
    candidates: Sequence[DesignCandidate],
) -> Floats:
    """Losses of all candidates, (k, objectives); infinite beyond the limits."""
    losses = np.full((len(candidates), len(objectives)), np.inf)
    for row, one in zip(losses, candidates, strict=True):
        figures = one.figures
        if figures and limits.excess(figures) == 0 and not _lacks(objectives, figures):
            row[:] = objective_losses(objectives, start, figures)
    return losses


def _front(losses: Floats) -> tuple[bool, ...]:
    """Which of k candidates are bettered by no other in all objectives, from losses (k, o)."""
    no_worse = np.all(losses[None] <= losses[:, None], axis=2)
    better = np.any(losses[None] < losses[:, None], axis=2)
    dominated = np.any(no_worse & better, axis=1)
    on_front = np.isfinite(losses).all(axis=1) & ~dominated
    return tuple(bool(one) for one in on_front)
