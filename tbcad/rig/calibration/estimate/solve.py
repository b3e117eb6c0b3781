"""Maximum a posteriori by sparse Gauss-Newton steps, robust against wrong highlights.

The sum of squares of (highlight - prediction) / sigma and of the parameters' deviations from their
prior means, in standard deviations, is minimised. While highlights may still be wrong, each counts
by Cauchy's loss of its residual's length; those that end too far off are then left out, and the
rest is solved by plain least squares, of which the covariance is known. Steps are damped as by
Levenberg and Marquardt. Own code instead of scipy.optimize.least_squares, whose loss would apply to
the prior too, and whose exact sparse steps it does not offer.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from tbcad.errors import InputError
from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes
from tbcad.rig.calibration.estimate.parameters import Block, Prior
from tbcad.rig.calibration.estimate.slopes import Slopes, covariances
from tbcad.rig.machine.machine import Highlights, Machine
from tbcad.types import Bools, Floats, Ints, Progress

MAX_STEPS = 60
CONVERGED, ROUGHLY = 1e-9, 1e-3  # of the cost, relative; before outliers are left out
FIRST_DAMPING, MAX_DAMPING = 1e-12, 1e6
LESS, MORE = 0.1, 30.0  # damping after a step that helps, and after one that does not
ROBUST_SIGMA = 3.0  # residual beyond which a highlight counts less and less, of both ways
FALSE_ALARM = 0.01  # chance that the farthest of good highlights is called an outlier
MAX_ROUNDS = 10  # of leaving out and solving again
SAME_NOISE = 1e-3  # relative
PROBES = 64  # random vectors that tell how many parameters the highlights fix, to a few
NOISE_SIGMAS = 3.0  # by which the noise must exceed what is said, to be taken for larger
MIN_FREEDOM = 20  # figures beyond the parameters that they fix, to measure their noise


@dataclass(frozen=True)
class Estimate:
    """The machine that explains the highlights best."""

    prior: Prior
    highlights: Highlights
    used: Bools  # which of them are no outliers, (n,)
    values: Floats  # free parameters in prior standard deviations, (q,)
    residual: Floats  # highlight less prediction, pixels, (n, 2)
    information: csc_array  # inverse of the parameters' covariance in these units, (q, q)
    noise_factor: float  # by which the noise is larger than the highlights say; 1 if not larger
    freedom: float  # number of figures of the used highlights, less the parameters that they fix
    steps: int

    @property
    def machine(self) -> Machine:
        """The estimated machine."""
        return self.prior.machine(self.values)

    @property
    def sigmas_off(self) -> Floats:
        """Length of each highlight's residual, in standard deviations of one way, (n,)."""
        length = np.linalg.norm(self.residual, axis=1)
        return np.asarray(length / (self.highlights.sigma * self.noise_factor))

    @cached_property
    def covariance(self) -> Floats:
        """Of the free parameters in prior standard deviations, (q, q)."""
        return self.covariance_rows(np.arange(len(self.values)))

    def covariance_rows(self, which: Ints) -> Floats:
        """The covariance's rows of s free parameters, (s, q)."""
        columns = np.zeros((len(self.values), len(which)))
        columns[which, np.arange(len(which))] = 1
        return np.asarray(_factor(self.information).solve(columns).T)

    def sigmas(self) -> dict[Block, Floats]:
        """Standard deviations of all parameters in their units, by block."""
        return self.prior.blocks(np.sqrt(np.diag(self.covariance)))

    def covariances(self, slopes: Slopes) -> Floats:
        """Of n groups of d figures by their derivatives, (n, d, d)."""
        size = next(iter(slopes.by.values())).shape[1]
        return covariances(self.covariance, slopes.matrix(self.prior), size)


def estimate(
    prior: Prior,
    highlights: Highlights,
    progress: Progress = lambda _: None,
    start: Floats | None = None,
) -> Estimate:
    """Estimate a machine, from parameters (q,) in prior deviations or the prior's mean on."""
    if not len(highlights):
        raise InputError("no highlights to calibrate from: see the faults of the run")
    every = np.ones(len(highlights), dtype=bool)
    problem = _Problem(prior, highlights, every, progress)
    values = np.zeros(len(prior.free)) if start is None else start
    values, steps = _minimum(problem, values, robust=True)
    # The median hardly changes by outliers; squares have one of 2 log 2.
    middle = float(np.median(_squares(problem, values)))
    problem = replace(problem, noise=max(1.0, math.sqrt(middle / (2 * math.log(2)))))
    freedom = 0.0
    for _ in range(MAX_ROUNDS):
        problem = replace(problem, used=_near(problem, values))
        values, more = _minimum(problem, values, robust=False)
        noise, freedom = _noise(problem, values)
        steps, change = steps + more, abs(noise / problem.noise - 1)
        problem = replace(problem, noise=noise)
        if change < SAME_NOISE and (_near(problem, values) == problem.used).all():
            break
    residual, slopes = problem.at(values)
    information = _information(slopes, problem.weight())
    return Estimate(
        prior=prior,
        highlights=highlights,
        used=problem.used,
        values=values,
        residual=residual,
        information=information,
        noise_factor=problem.noise,
        freedom=freedom,
        steps=steps,
    )


@dataclass(frozen=True)
class _Problem:
    prior: Prior
    highlights: Highlights
    used: Bools
    progress: Progress
    noise: float = 1.0
    last: dict[bytes, tuple[Floats, csr_array]] = field(default_factory=dict)  # of `at`

    def at(self, values: Floats) -> tuple[Floats, csr_array]:
        """Residuals in pixels (n, 2), and the predictions' derivatives (2 n, q)."""
        h, key = self.highlights, values.tobytes()
        if key not in self.last:  # steps, noise and outliers ask for the same
            self.last.clear()
            pixel, slopes = highlights_with_slopes(self.prior, values, h.frame, h.sphere, h.led)
            self.last[key] = h.pixel - pixel, slopes
        return self.last[key]

    def weight(self) -> Floats:
        """Of each highlight's figures, (n,): zero for outliers."""
        return np.where(self.used, 1 / (self.highlights.sigma * self.noise) ** 2, 0.0)


def _minimum(problem: _Problem, start: Floats, robust: bool) -> tuple[Floats, int]:
    """Parameters (q,) from which no step goes down, and the number of steps to them."""
    values, damping = start, FIRST_DAMPING
    residual, slopes = problem.at(values)
    cost, weight = _cost(problem, residual, values, robust)
    for step in range(1, MAX_STEPS + 1):
        information = _information(slopes, weight)
        gradient = slopes.T @ (np.repeat(weight, 2) * residual.ravel()) - values
        while damping < MAX_DAMPING:
            damped = information + diags_array(damping * information.diagonal(), format="csc")
            there = values + _factor(damped).solve(gradient)
            moved, moved_slopes = problem.at(there)
            lower, new_weight = _cost(problem, moved, there, robust)
            if lower <= cost:
                break
            damping *= MORE
        else:
            return values, step
        problem.progress(f"step {step}: {len(problem.highlights)} highlights")
        gain, damping = cost - lower, max(damping * LESS, FIRST_DAMPING)
        values, residual, slopes, cost, weight = there, moved, moved_slopes, lower, new_weight
        if gain <= (ROUGHLY if robust else CONVERGED) * cost:
            return values, step
    return values, MAX_STEPS


def _cost(
    problem: _Problem, residual: Floats, values: Floats, robust: bool
) -> tuple[float, Floats]:
    """Cost to minimise, and each highlight's weight in the next step, (n,)."""
    weight = problem.weight()
    square = np.where(np.isfinite(residual).all(axis=1), (residual**2).sum(axis=1), np.inf) * weight
    if not robust:
        return float(square[problem.used].sum() + values @ values), weight
    share = square / ROBUST_SIGMA**2
    return float(ROBUST_SIGMA**2 * np.log1p(share).sum() + values @ values), weight / (1 + share)


def _information(slopes: csr_array, weight: Floats) -> csc_array:
    """Of the free parameters in prior standard deviations, whose own information is one."""
    scaled = diags_array(np.repeat(np.sqrt(weight), 2)) @ slopes
    return csc_array(scaled.T @ scaled + diags_array(np.ones(slopes.shape[1])))


def _factor(information: csc_array) -> SuperLU:
    return splu(
        information,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def _squares(problem: _Problem, values: Floats) -> Floats:
    residual, _ = problem.at(values)
    return np.asarray((residual**2).sum(axis=1) / problem.highlights.sigma**2)


def _near(problem: _Problem, values: Floats) -> Bools:
    """Highlights that chance may have put where they are."""
    limit = problem.noise * outlier_limit(len(problem.highlights))
    return np.asarray(_squares(problem, values) <= limit**2)


def outlier_limit(count: int) -> float:
    """Length of a residual, in standard deviations, that the farthest of n rarely exceeds."""
    return math.sqrt(2 * math.log(count / FALSE_ALARM))


def _noise(problem: _Problem, values: Floats) -> tuple[float, float]:
    """By how much the noise exceeds what the highlights say, and from how many figures."""
    _, slopes = problem.at(values)
    factor = _factor(_information(slopes, problem.weight()))
    signs = np.random.default_rng(0).choice((-1.0, 1.0), size=(len(values), PROBES))
    trace = float((signs * factor.solve(signs)).sum()) / PROBES  # of the covariance: Hutchinson's
    freedom = 2 * float(problem.used.sum()) - (len(values) - trace)
    if freedom < MIN_FREEDOM:
        return 1.0, freedom
    square = float(_squares(problem, values)[problem.used].sum())
    ratio = math.sqrt(square / freedom)
    by_chance = 1 + NOISE_SIGMAS / math.sqrt(2 * freedom)
    return (ratio if ratio > by_chance else 1.0), freedom
