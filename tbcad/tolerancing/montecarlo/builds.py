"""Thousands of simulated builds: how many cover enough, and what each kind of error costs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from math import sqrt
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
from scipy.optimize import brentq

from tbcad.light.simulate.parallel import chunks, in_threads
from tbcad.tolerancing.montecarlo.coverage import coverage, pointing
from tbcad.tolerancing.montecarlo.draws import ShellDraws, WarpMaps, draw, shell_error_shapes
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, warp_maps_of
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.process.process import Process
from tbcad.types import Floats, Ints

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

BUILDS_PER_BATCH = 10  # builds in one unit of work: few enough that all workers end together
CONFIDENCE = 0.95  # probability that the true yield lies in the reported interval
AnyResult = TypeVar("AnyResult", bound="DataclassInstance")
Case: TypeAlias = Callable[[range], AnyResult]
RunBatches: TypeAlias = Callable[[Any, Sequence[range]], list[Any]]


@dataclass(frozen=True)
class CameraCoverage:
    """Exact coverage diameters, mm, (s, v), in s builds, by number, of v virtual cameras."""

    coverage: Floats

    def __len__(self) -> int:
        return len(self.coverage)

    @property
    def worst(self) -> Floats:
        """Minimum coverage of each build, mm, (s,)."""
        return np.asarray(self.coverage.min(axis=1))


@dataclass(frozen=True)
class CoverageResult(CameraCoverage):
    """Coverage and pointing errors."""

    # distance at the object between the ray of each mirror's centre pixel and the designed ray, a's
    # mirrors, then b's, mm, (s, 2 m); not finite where the ray misses its mirror
    offset: Floats

    @property
    def worst_camera(self) -> Ints:
        """Number of the virtual camera with the minimum coverage of each build, (s,)."""
        return np.asarray(np.argmin(self.coverage, axis=1))

    def quantiles(self, shares: Sequence[float]) -> Floats:
        """Quantiles of coverage over the builds, mm, of k shares at each camera, (k, v)."""
        return np.asarray(np.quantile(self.coverage, shares, axis=0))


@dataclass(frozen=True)
class YieldEstimate:
    """Share of builds whose every virtual camera covers enough."""

    share: float
    low: float  # lower end of the confidence interval of the true share
    high: float  # upper end


@dataclass(frozen=True)
class ShellCase:
    """Builds of the shell to be simulated; it can be sent to another process."""

    edge_models: EdgeModels  # both halves as designed
    errors: Errors
    seed: int
    warp: WarpMaps | None = field(init=False)  # what the process's warp does to both halves

    def __post_init__(self) -> None:
        object.__setattr__(self, "warp", warp_maps_of(self.edge_models, self.errors))

    def draws(self, builds: range) -> tuple[ShellDraws, ShellDraws]:
        """Errors of both halves of the builds of these numbers."""
        half = self.edge_models[0]
        return draw(self.errors, self.seed, builds, len(half), self.warp, len(half.walls))


@dataclass(frozen=True)
class MonteCarloCase(ShellCase):
    """Simulates builds of the shell."""

    def __call__(self, builds: range) -> CoverageResult:
        """Result of the builds of these numbers."""
        draws = self.draws(builds)
        offsets = list(map(pointing, self.edge_models, draws))
        return CoverageResult(coverage(self.edge_models, draws), np.concatenate(offsets, axis=1))


@dataclass(frozen=True)
class CoverageCase(ShellCase):
    """The same builds as MonteCarloCase's, but only what their virtual cameras cover."""

    worst_only: bool = False  # exact minima of builds only, the others no lower; faster

    def __call__(self, builds: range) -> CameraCoverage:
        """Result of the builds of these numbers."""
        return CameraCoverage(coverage(self.edge_models, self.draws(builds), self.worst_only))


def simulate(
    case: Case[AnyResult], builds: int, run_batches: RunBatches = in_threads, first: int = 0
) -> AnyResult:
    """Result of builds, numbered from the first; workers and batches do not change it."""
    numbers = range(first, first + builds)
    batches = [numbers[part] for part in chunks(builds, BUILDS_PER_BATCH)]
    results: list[AnyResult] = run_batches(case, batches)
    return joined_results(results)


def joined_results(results: Sequence[AnyResult]) -> AnyResult:
    """Results of consecutive builds as one; at least one is needed."""
    kind = type(results[0])
    names = [one.name for one in fields(kind)]
    return kind(*(np.concatenate([getattr(one, name) for one in results]) for name in names))


def coverage_at_yield(worst: Floats, share: float) -> float:
    """Coverage, mm, that a share of the builds reach with their worst camera (s,).

    It is at least the target exactly where the yield is that share: an order statistic, without
    interpolation between two builds.
    """
    bad = int((1 - share) * len(worst) + 1e-9)
    return float(np.sort(worst)[min(bad, len(worst) - 1)])


def estimate_yield(worst: Floats, target: float) -> YieldEstimate:
    """Share of builds whose worst coverage (s,) is at least the target (mm), with its interval."""
    good, count = int(np.count_nonzero(worst >= target)), len(worst)
    return YieldEstimate(good / count, *wilson_interval(good, count))


def wilson_interval(good: int, count: int) -> tuple[float, float]:
    """Confidence interval (95 %) of a share of which `good` out of `count` were seen.

    E. B. Wilson, Probable inference, J. Am. Stat. Assoc. 22 (1927) 209-212.
    """
    z = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)
    share = good / count
    middle = share + z * z / (2 * count)
    width = z * sqrt(share * (1 - share) / count + (z / (2 * count)) ** 2)
    low, high = ((middle + sign * width) / (1 + z * z / count) for sign in (-1, 1))
    return (low if good else 0.0), (high if good < count else 1.0)


def yield_sentence(process: Process, worst: Floats, target: float) -> str:
    """Yield of builds, by minimum coverage of each (s,), and what a median one covers."""
    return (
        f"Built by {process.name} ({process.title}), "
        f"{percent(estimate_yield(worst, target))} of the builds "
        f"cover {target:g} mm with every virtual camera; the worst camera of a build "
        f"covers {np.median(worst):.2f} mm (median; 1 % cover less than "
        f"{np.quantile(worst, 0.01):.2f})."
    )


def percent(estimate: YieldEstimate) -> str:
    """A share with its interval."""
    return f"{estimate.share:.1%} ({estimate.low:.1%} to {estimate.high:.1%})"


WorstCoverage = Callable[[Errors], Floats]
"""Minimum coverage of each of some builds with some errors, mm, (s,)."""

LARGEST_FACTOR = 1000.0  # on an error, beyond which its kind is taken not to matter
FACTOR_TOLERANCE = 0.02  # accuracy of the factor, as a share of itself
# The next factor tried lies beyond the one that a straight line predicts, within these bounds.
OVERSHOOT, SMALLEST_STEP, LARGEST_STEP = 1.2, 1.5, 10.0


@dataclass(frozen=True)
class SingleErrorEffect:
    """Effect of one kind of error when there is no other."""

    kind: str  # its name, as in Errors
    loss: float  # mean coverage that the worst virtual camera loses, mm
    loss_at_yield: float  # the same in the worst build of those that are to see all, mm
    tolerable_factor: float  # on the error, at which the yield is just reached; may be inf


def present_kinds(errors: Errors) -> list[str]:
    """The kinds of error that are not zero."""
    return [kind for kind, error in vars(errors).items() if error.spread != 0 or error.mean != 0]


def shell_kinds(errors: Errors, walls: int) -> list[str]:
    """Those that a shell with some walls of pedestals in each half has."""
    shapes = shell_error_shapes(1, 1, walls)
    return [kind for kind in present_kinds(errors) if 0 not in shapes.get(kind, (0,))]


def only_kind(errors: Errors, kind: str) -> Errors:
    """One kind of error, and no other."""
    return replace(Errors(), **{kind: getattr(errors, kind)})


def scaled(errors: Errors, factor: float) -> Errors:
    """Errors, spread and mean, multiplied."""
    kinds: list[Error] = list(vars(errors).values())
    return Errors(*(replace(k, spread=k.spread * factor, mean=k.mean * factor) for k in kinds))


def one_at_a_time(
    errors: Errors, kind: str, wanted_yield: float, target: float, worst: WorstCoverage
) -> SingleErrorEffect:
    """Effect of one kind of error by itself, where builds must cover the target, mm."""
    single = only_kind(errors, kind)
    designed, seen = worst(Errors()).mean(), worst(single)
    return SingleErrorEffect(
        kind,
        loss=float(designed - seen.mean()),
        loss_at_yield=float(designed) - coverage_at_yield(seen, wanted_yield),
        tolerable_factor=tolerable_factor(single, wanted_yield, target, worst),
    )


def tolerable_factor(
    errors: Errors, wanted_yield: float, target: float, worst: WorstCoverage
) -> float:
    """Factor on errors up to which the yield is reached; 0 where it is missed without errors.

    The same draws are multiplied, so the loss grows steadily with the factor.
    """

    def excess(factor: float) -> float:
        return coverage_at_yield(worst(scaled(errors, factor)), wanted_yield) - target

    spare = excess(0.0)
    if spare < 0:
        return 0.0
    high, remaining = 1.0, excess(1.0)
    while remaining >= 0:
        if high >= LARGEST_FACTOR:
            return float("inf")
        step = OVERSHOOT * spare / max(spare - remaining, 1e-9)
        high *= float(np.clip(step, SMALLEST_STEP, LARGEST_STEP))
        remaining = excess(high)
    return float(brentq(excess, 0.0, high, xtol=1e-4, rtol=FACTOR_TOLERANCE, maxiter=40))
