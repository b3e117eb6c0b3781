"""Differential evolution over places, each judged once: the same on any number of cores."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from tbcad.atomic_files import replace_files
from tbcad.errors import InputError
from tbcad.optimize.candidate import (
    Candidate,
    Figures,
    Limits,
    Place,
    bounds,
    evaluate,
    place_of,
    rounded,
)
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
ANY_SIZE = Limits(np.inf, np.inf)

Record: TypeAlias = dict[str, object]

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
        spec: the design that it begins from.
        objectives: what is made better; all count alike, as ratios to the first design.
        budget: number of places that are judged at most.
        max_size_mm: longest side of the machine; None: of the first design's.
        max_view_angle_deg: of the lens; None: what the first design needs.
    """

    spec: Spec
    objectives: tuple[Objective, ...]
    budget: int
    max_size_mm: float | None = None
    max_view_angle_deg: float | None = None

    def limits(self, start: Figures) -> Limits:
        """What candidates must keep, by the figures of the first design."""
        return Limits(
            self.max_size_mm or start.size_mm, self.max_view_angle_deg or start.view_angle_deg
        )

    def key(self) -> str:
        """What judgements depend on: those of another design are of no use."""
        text = json.dumps(spec_dict(self.spec), sort_keys=True)
        return sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Attributes:
        start: the design that it began from.
        limits: that candidates had to keep.
        best: the best candidate.
        candidates: all that were judged, in the order in which they were.
        on_front: which of them no other one that keeps the limits betters in all objectives.
    """

    start: Candidate
    limits: Limits
    best: Candidate
    candidates: tuple[Candidate, ...]
    on_front: tuple[bool, ...]


def parse_objectives(names: Sequence[str]) -> tuple[Objective, ...]:
    """Objectives from their names, each once.

    Raises:
        InputError: a name is none.
    """
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

    Args:
        asked: the design, what to improve, limits.
        store: file of judgements (JSON lines): it is read when it exists, and written after
            every generation, so that a search that was stopped goes on.
        scheduler: address of a Dask scheduler; None for this machine's cores.
        progress: called after every generation.

    Raises:
        InputError: the first design cannot be made; the store is of another design.
    """
    judged = _read(store, asked) if store else {}
    judge = partial(_judge, asked, judged, store, scheduler, progress)
    start = judge(ANY_SIZE, [place_of(asked.spec)])[0]
    if start.figures is None:
        raise InputError(f"the design to begin from cannot be made: {start.reason}")
    limits = asked.limits(start.figures)
    value = partial(_value, asked.objectives, limits, start.figures)
    differential_evolution(
        _never_called,
        Bounds(*np.transpose(bounds(asked.spec, limits.size_mm))),
        x0=np.array(start.place),
        maxiter=max(1, asked.budget // POPULATION - 1),
        popsize=POPULATION // len(start.place),
        tol=0,
        rng=np.random.default_rng(SEED),
        polish=False,
        updating="deferred",
        workers=lambda _, places: [
            *map(value, judge(limits, [rounded(np.array(p)) for p in places]))
        ],
    )
    candidates = tuple(judged.values())
    losses = _losses(asked.objectives, limits, start.figures, candidates)
    return SearchResult(start, limits, min(candidates, key=value), candidates, _front(losses))


def _never_called(place: Floats) -> float:
    """A generation is judged as a whole, by `workers`."""
    raise AssertionError(place)


def _value(
    objectives: Sequence[Objective], limits: Limits, start: Figures, one: Candidate
) -> float:
    """What is minimised: the mean of all objectives, relative to the first design."""
    if one.figures is None:
        return IMPOSSIBLE
    if excess := limits.excess(one.figures):
        return BEYOND + EXCESS * excess
    if _lacks(objectives, one.figures):
        return IMPOSSIBLE
    return float(np.mean(objective_losses(objectives, start, one.figures)))


def objective_losses(objectives: Sequence[Objective], start: Figures, one: Figures) -> list[float]:
    """By how much a design is worse than the first, for each objective: logarithms of ratios."""
    return [float(LOSSES[name](one) - LOSSES[name](start)) for name in objectives]


def _judge(
    asked: Search,
    judged: dict[Place, Candidate],
    store: Path | None,
    scheduler: str | None,
    progress: Progress,
    limits: Limits,
    places: Sequence[Place],
) -> list[Candidate]:
    """Candidates at places, of which only those are worked out that the store does not have."""
    wanted = limits if "ssim" in asked.objectives else None
    new = [p for p in dict.fromkeys(places) if _is_open(asked.objectives, limits, judged.get(p))]
    for one in run_units(partial(evaluate, asked.spec, wanted), new, scheduler):
        judged[one.place] = one
    if store and new:
        replace_files(store.parent, {store.name: _lines(asked, judged)})
    progress(f"{len(judged)} of about {asked.budget} candidates")
    return [judged[place] for place in places]


def _is_open(objectives: Sequence[Objective], limits: Limits, known: Candidate | None) -> bool:
    """Whether a candidate has to be judged, or judged again."""
    if known is None or known.figures is None:
        return known is None
    return _lacks(objectives, known.figures) and limits.excess(known.figures) == 0


def _lacks(objectives: Sequence[Objective], figures: Figures) -> bool:
    """Whether an earlier search, of other aims, did not measure what is an aim now."""
    return "ssim" in objectives and figures.ssim is None


def _losses(
    objectives: Sequence[Objective],
    limits: Limits,
    start: Figures,
    candidates: Sequence[Candidate],
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


def _lines(asked: Search, judged: dict[Place, Candidate]) -> bytes:
    head = {"schema": "tbcad-candidates/1", "design": asked.key()}
    rows = [head, *map(asdict, judged.values())]
    return "".join(json.dumps(row) + "\n" for row in rows).encode()


def _read(store: Path, asked: Search) -> dict[Place, Candidate]:
    """Judgements of an earlier search; none where there is no file."""
    if not store.exists():
        return {}
    try:
        head, *rows = map(json.loads, store.read_text(encoding="utf-8").splitlines())
        known = head["design"] == asked.key()
        found = [_candidate(row) for row in rows]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{store}: no list of candidates ({error}): remove it") from None
    if not known:
        raise InputError(f"{store}: of another design: name another --out, or remove the file")
    return {one.place: one for one in found}


def _candidate(row: Record) -> Candidate:
    place, figures = row["place"], row["figures"]
    x, z, semi_minor, along_x, along_y = np.array(place, dtype=float).tolist()
    if figures is not None and not isinstance(figures, dict):
        raise ValueError("figures are not an object")
    numbers = {
        name: None if number is None else float(number) for name, number in (figures or {}).items()
    }
    return Candidate(
        (x, z, semi_minor, along_x, along_y),
        Figures(**numbers) if figures else None,  # type: ignore[arg-type]
        str(row["reason"]),
    )
