"""Differential evolution over places, each judged once: the same on any number of cores."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from tbcad.atomic_files import replace_files
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
from tbcad.optimizing.views import ViewsBy
from tbcad.schedule import run_units
from tbcad.spec.design import Spec
from tbcad.spec.load import spec_dict
from tbcad.types import Floats, Progress

Objective: TypeAlias = Literal["minimum", "pixels", "evenness", "ssim", "size"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)

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
class Search:
    """What a search is asked.

    Attributes:
        objectives: what is made better; all count alike, as ratios to the first design.
        budget: number of places that are judged at most.
        max_size_mm: longest side of the machine; None: of the first design's.
        max_view_angle_deg: of the lens; None: what the first design needs.
        front: whether places are searched, too, where one of several objectives counts most.
        method: of the views that are compared, where SSIM is an objective.
    """

    spec: Spec
    objectives: tuple[Objective, ...]
    budget: int
    max_size_mm: float | None = None
    max_view_angle_deg: float | None = None
    front: bool = False
    method: ViewsBy = "nearest"

    def limits(self, start: Figures) -> MachineLimits:
        """What candidates must keep, by the figures of the first design."""
        return MachineLimits(
            self.max_size_mm or start.size_mm, self.max_view_angle_deg or start.view_angle_deg
        )

    def key(self) -> str:
        """What judgements depend on: those of another design are of no use."""
        text = json.dumps(spec_dict(self.spec), sort_keys=True)
        if self.method != "nearest":
            text += self.method
        return sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Attributes:
        candidates: all that were judged, in the order in which they were.
        on_front: which of them no other one that keeps the limits betters in all objectives.
    """

    start: DesignCandidate
    limits: MachineLimits
    best: DesignCandidate
    candidates: tuple[DesignCandidate, ...]
    on_front: tuple[bool, ...]


def parse_objectives(names: Sequence[str]) -> tuple[Objective, ...]:
    """Objectives from their names, each once."""
    for name in names:
        if name not in OBJECTIVES:
            known = ", ".join(OBJECTIVES)
            raise InputError(f"--for is {name!r}, allowed is one of {known}: change it")
    return tuple(one for one in OBJECTIVES if one in names)


def search(
    asked: Search,
    store: Path | None = None,
    scheduler: str | None = None,
    progress: Progress = lambda _: None,
) -> SearchResult:
    """Search a better place of camera and ellipsoid.

    The store, a file of judgements (JSON lines), is read when it exists, and written after every
    generation, so that a search that was stopped goes on.

    Raises:
        InputError: the first design cannot be made; the store is of another design.
    """
    judged = read_store(store, asked.key()) if store else {}
    judge = partial(_judge, asked, judged, store, scheduler, progress)
    start = judge(ANY_SIZE, [place_of(asked.spec)])[0]
    if start.figures is None:
        raise InputError(f"the design to begin from cannot be made: {start.reason}")
    limits = asked.limits(start.figures)
    value = partial(_value, asked.objectives, limits, start.figures)
    every = weightings(len(asked.objectives)) if asked.front else [_even(len(asked.objectives))]
    generations = asked.budget // len(every) // POPULATION
    for weights in every:
        _evolve(asked, limits, start.place, max(1, generations - 1), judge, partial(value, weights))
    candidates = tuple(judged.values())
    losses = _losses(asked.objectives, limits, start.figures, candidates)
    best = min(candidates, key=partial(value, _even(len(asked.objectives))))
    return SearchResult(
        start,
        limits,
        best,
        candidates,
        _front(losses),
    )


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
    asked: Search,
    limits: MachineLimits,
    start: Place,
    generations: int,
    judge: Callable[[MachineLimits, Sequence[Place]], list[DesignCandidate]],
    value: Callable[[DesignCandidate], float],
) -> None:
    """Judge generations of places, each nearer to the lowest value."""
    differential_evolution(
        _never_called,
        Bounds(*np.transpose(bounds(asked.spec, limits.size_mm))),
        x0=np.array(start),
        maxiter=generations,
        popsize=POPULATION // len(start),
        tol=0,
        rng=np.random.default_rng(SEED),
        polish=False,
        updating="deferred",
        workers=lambda _, places: [
            *map(value, judge(limits, [rounded(np.array(p)) for p in places]))
        ],
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
    asked: Search,
    judged: dict[Place, DesignCandidate],
    store: Path | None,
    scheduler: str | None,
    progress: Progress,
    limits: MachineLimits,
    places: Sequence[Place],
) -> list[DesignCandidate]:
    """Candidates at places, of which only those are worked out that the store does not have."""
    wanted = limits if "ssim" in asked.objectives else None
    new = [p for p in dict.fromkeys(places) if _is_open(asked.objectives, limits, judged.get(p))]
    for one in run_units(
        partial(evaluate, asked.spec, wanted, method=asked.method), new, scheduler
    ):
        judged[one.place] = one
    if store and new:
        replace_files(store.parent, {store.name: store_bytes(asked.key(), judged)})
    progress(f"{len(judged)} of about {asked.budget} candidates")
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
    none = [np.inf] * len(objectives)
    return np.array(
        [
            objective_losses(objectives, start, one.figures)
            if one.figures
            and limits.excess(one.figures) == 0
            and not _lacks(objectives, one.figures)
            else none
            for one in candidates
        ]
    )


def _front(losses: Floats) -> tuple[bool, ...]:
    """Which of k candidates are bettered by no other in all objectives, from losses (k, o)."""
    no_worse = np.all(losses[None] <= losses[:, None], axis=2)
    better = np.any(losses[None] < losses[:, None], axis=2)
    dominated = np.any(no_worse & better, axis=1)
    on_front = np.isfinite(losses).all(axis=1) & ~dominated
    return tuple(bool(one) for one in on_front)
