"""Differential evolution over places, each judged once: the same on any number of cores.

Its files: the better design, all candidates, and a plot.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from tbcad.cad.formats.checked_files import toml_text
from tbcad.common.atomic_files import replace_files
from tbcad.common.results import PlotPanel, Record, Series, Table, csv_text, plot_file
from tbcad.common.schedule import run_units
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import spec_dict
from tbcad.errors import InputError
from tbcad.optimizing.candidate import (
    SCHEMA,
    DesignCandidate,
    Figures,
    MachineLimits,
    Place,
    bounds,
    evaluate,
    place_of,
    placed,
    read_store,
    rounded,
    store_bytes,
)
from tbcad.options.builds import Objective, OptimizeOptions
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
    judges = _Judges(spec, asked, store)
    start = judges.judge([place_of(spec)], ANY_SIZE)[0]
    if start.figures is None:
        raise InputError(f"the design to begin from cannot be made: {start.reason}")
    judges.start, judges.limits = (
        start.figures,
        MachineLimits(
            asked.max_size_mm or start.figures.size_mm,
            asked.max_view_angle_deg or start.figures.view_angle_deg,
        ),
    )
    even, *most = weightings(len(asked.aims))
    every = [even, *most] if asked.front else [even]
    generations = max(1, asked.candidates // len(every) // POPULATION - 1)
    box = Bounds(*np.transpose(bounds(spec, judges.limits.size_mm)))
    for weights in every:
        judges.evolve(box, start.place, generations, weights)
    candidates = tuple(judges.judged.values())
    best = min(candidates, key=partial(judges.value, even))
    on_front = _front(np.array([*map(judges.losses, candidates)]))
    return SearchResult(start, judges.limits, best, candidates, on_front)


def weightings(objectives: int) -> list[Floats]:
    """How much each of k objectives counts, in one search after the other, (k,) each.

    First all alike, then one after the other most: places between the extremes of a Pareto front,
    and near them.
    """
    even = np.full(objectives, 1 / objectives)
    most = even * (1 - MOST) + MOST * np.eye(objectives)
    return [even, *(most if objectives > 1 else ())]


class _Judges:
    """Candidates of a design with their figures, each worked out once, and what they are worth."""

    def __init__(self, spec: Spec, asked: OptimizeOptions, store: Path | None) -> None:
        """Read what an earlier search judged; judgements of another design are of no use."""
        self._spec, self._asked, self._store = spec, asked, store
        self._method, self._optics = asked.method or "nearest", asked.optics or "real"
        told = [SCHEMA, spec_dict(spec), self._method, self._optics]
        self._key = sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
        self.judged = read_store(store, self._key) if store else {}
        self.start: Figures | None = None
        self.limits = ANY_SIZE

    def judge(
        self, places: Sequence[Place], limits: MachineLimits | None = None
    ) -> list[DesignCandidate]:
        """Candidates at places, of which only those are worked out that the store does not have."""
        asked, limits = self._asked, limits or self.limits
        new = [p for p in dict.fromkeys(places) if self._is_open(limits, self.judged.get(p))]
        wanted = limits if "ssim" in asked.aims else None
        work = partial(evaluate, self._spec, wanted, method=self._method, optics=self._optics)
        for one in run_units(work, new, asked.scheduler):
            self.judged[one.place] = one
        if (store := self._store) and new:
            replace_files(store.parent, {store.name: store_bytes(self._key, self.judged)})
        asked.detail(f"{len(self.judged)} of about {asked.candidates} candidates")
        return [self.judged[place] for place in places]

    def _is_open(self, limits: MachineLimits, known: DesignCandidate | None) -> bool:
        """Whether a candidate has to be judged, or judged again."""
        if known is None or known.figures is None:
            return known is None
        return self._lacks(known.figures) and limits.excess(known.figures) == 0

    def _lacks(self, figures: Figures) -> bool:
        """Whether an earlier search, of other aims, did not measure what is an aim now."""
        return "ssim" in self._asked.aims and figures.ssim is None

    def evolve(self, box: Bounds, start: Place, generations: int, weights: Floats) -> None:
        """Judge generations of places, each nearer to the lowest value by some weights."""
        value = partial(self.value, weights)
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
            workers=lambda _, places: [
                value(one) for one in self.judge([rounded(np.array(place)) for place in places])
            ],
        )

    def value(self, weights: Floats, one: DesignCandidate) -> float:
        """What is minimised: the weighted mean of all objectives, relative to the first design."""
        if one.figures and (excess := self.limits.excess(one.figures)):
            return BEYOND + EXCESS * excess
        return min(float(weights @ self.losses(one)), IMPOSSIBLE)

    def losses(self, one: DesignCandidate) -> Floats:
        """By how much one is worse than the first design, (objectives,): logarithms of ratios.

        Infinite where it cannot be made, is beyond the limits or lacks a figure.
        """
        figures, start, aims = one.figures, self.start, self._asked.aims
        if not (figures and start) or self.limits.excess(figures) > 0 or self._lacks(figures):
            return np.full(len(aims), np.inf)
        return np.array([LOSSES[name](figures) - LOSSES[name](start) for name in aims])


def _never_called(place: Floats) -> float:
    """A generation is judged as a whole, by `workers`."""
    raise AssertionError(place)


def _front(losses: Floats) -> tuple[bool, ...]:
    """Which of k candidates are bettered by no other in all objectives, from losses (k, o)."""
    no_worse = np.all(losses[None] <= losses[:, None], axis=2)
    better = np.any(losses[None] < losses[:, None], axis=2)
    dominated = np.any(no_worse & better, axis=1)
    on_front = np.isfinite(losses).all(axis=1) & ~dominated
    return tuple(bool(one) for one in on_front)


FIGURES = tuple(field.name for field in fields(Figures))
VARIABLES = ("camera_x_mm", "camera_z_mm", "semi_minor_mm", "stretch_x", "stretch_y")
COLUMNS = (*VARIABLES, *FIGURES, "on_front", "reason")
LABELS = {
    "minimum_px": "pixels, minimum",
    "median_px": "pixels, median",
    "mean_log_px": "pixels, mean of logarithms",
    "variation": "coefficient of variation",
    "size_mm": "longest side, mm",
    "view_angle_deg": "angle of view, deg",
    "ssim": "SSIM of views",
}


Groups = dict[str, tuple[list[Figures], str]]
"""By label: what is drawn, and in which style."""


def search_files(result: SearchResult, spec: Spec, asked: OptimizeOptions) -> dict[str, bytes]:
    """The files of a search by name: the same search gives the same bytes."""
    contents = (
        design_text(result, spec).encode(),
        csv_text(candidate_table(result)).encode(),
        plot_file(panels(result), asked.plot),
    )
    return {file.name: data for file, data in zip(asked.files, contents, strict=True)}


def design_text(result: SearchResult, spec: Spec) -> str:
    """The best design as TOML: every key that is not the default, under what it gives."""
    found = f"{spec.name}, with other places and directions: what tbcad optimize found."
    lines = [f"# {found}", "#", *(f"# {line}" for line in comparison(result))]
    changed = placed(spec, result.best.place)
    defaults = Spec.model_validate({"optics": {"n": spec.optics.n}})  # some follow from n
    rest = _assignments(spec_dict(changed), spec_dict(defaults))
    lines += ["", f"optics.n = {spec.optics.n}", *rest]
    return "\n".join(lines) + "\n"


def comparison(result: SearchResult) -> Iterator[str]:
    """Every figure of the first design and of the best one, a line each."""
    start, best = result.start.figures, result.best.figures
    yield f"{'':28} {'before':>9} {'after':>9}"
    for name, label in LABELS.items():
        before, after = getattr(start, name), getattr(best, name)
        if before is None or after is None:
            continue
        yield f"{label:28} {before:9.4g} {after:9.4g}"


def candidate_table(result: SearchResult) -> Table:
    """All candidates, in the order in which they were judged."""
    records: list[Record] = [
        {
            **dict(zip(VARIABLES, one.place, strict=True)),
            **{name: getattr(one.figures, name, None) for name in FIGURES},
            **{"on_front": int(on_front), "reason": one.reason},
        }
        for one, on_front in zip(result.candidates, result.on_front, strict=True)
    ]
    return Table.of_records("candidates", records, columns=COLUMNS)


def panels(result: SearchResult) -> tuple[PlotPanel, ...]:
    """Candidates by pixels and evenness, by pixels and size, and by SSIM where it was measured."""
    figures = [one.figures for one in result.candidates if one.figures]
    kept = [one for one in figures if result.limits.excess(one) == 0]
    front = zip(result.candidates, result.on_front, strict=True)
    best = [one.figures for one, on_front in front if on_front and one.figures]
    assert result.start.figures
    assert result.best.figures
    groups: Groups = {
        "candidates": (figures, "C2."),
        "within the limits": (kept, "C0."),
        "not bettered by any other": (best, "C1o"),
        "before": ([result.start.figures], "kx"),
        "after": ([result.best.figures], "k+"),
    }
    axes = [
        ("Pixels of the virtual cameras", "minimum_px", "variation"),
        ("Pixels and size", "size_mm", "minimum_px"),
    ]
    if result.best.figures.ssim is not None:
        axes.append(("Views and size", "size_mm", "ssim"))
    return tuple(_panel(title, groups, (x, y)) for title, x, y in axes)


def _panel(title: str, groups: Groups, axes: tuple[str, str]) -> PlotPanel:
    (x, y), series = axes, []
    for label, (some, style) in groups.items():
        measured = [one for one in some if getattr(one, y) is not None]
        places, values = (np.array([getattr(one, name) for one in measured]) for name in axes)
        series.append(Series(label, places, values, style))
    return PlotPanel(title, LABELS[x], LABELS[y], tuple(series), logarithmic="xy")


def _assignments(values: dict[str, Any], defaults: dict[str, Any], name: str = "") -> Iterator[str]:
    """Lines of TOML for what differs from the defaults, by dotted keys."""
    for key, value in values.items():
        default = defaults.get(key)
        if isinstance(value, dict) and isinstance(default, dict):
            yield from _assignments(value, default, f"{name}{key}.")
        elif value != default:
            yield f"{name}{key} = {toml_text(value)}"
