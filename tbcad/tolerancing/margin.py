"""Margins on the design's target that a process needs: one for all mirrors, or each its own.

A build counts for the yield when no virtual camera loses more than its margin. With the mean m of a
mirror's loss and its deviation s upwards, each mirror gets the margin m + k s, with one k for all.
The least k with which the wanted yield is reached needs no search: it is an order statistic of the
largest (loss - m) / s of each build. Radii change a little what errors cost, so the design is made
again with these margins and simulated again, until they are enough.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import ceil
from typing import TypeAlias

import numpy as np

from tbcad.core.mirrors.array import DIRECTION_DIGITS, design
from tbcad.core.spec.design import MAX_MARGIN, Spec, spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.light.simulate.capture.photograph import virtual_camera_pixels
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.montecarlo.builds import coverage_at_yield
from tbcad.tolerancing.montecarlo.coverage import virtual_camera_numbers
from tbcad.tolerancing.montecarlo.edge_model import EdgeModel, EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.types import Bools, Floats, Ints, Progress

MAX_TRIES = 6
STEP_MM = 0.01  # margins are rounded up to a multiple of it
SolvedDesigns: TypeAlias = Callable[[Spec], EdgeModels]
"""The fast model of a design, or a SpecError; each is solved once."""
CoverageOfDesign = Callable[[Errors, EdgeModels], Floats]
"""Minimum coverage of s builds of a design with some errors, or that of its v cameras, mm."""
MAX_ROUNDS = 5
KNOWN_MM = 1e-6  # deviation below which a loss counts as known, mm: rounding
FREE_MM = 1e-3  # a mirror that covers so much beyond its target has the largest radius allowed
FLIP_Y = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Margin:
    """The margin that a process needs."""

    mm: float | None  # margin beyond the capture diameter; None where no feasible margin is enough
    share: float  # yield at that margin, or at the last one tried
    reason: str = ""  # why there is none, else ""


def solved_designs() -> SolvedDesigns:
    """Fast models of designs with several margins, for all processes."""
    return cache(lambda spec: edge_models(reflectors(design(spec))))


def margin(
    spec: Spec,
    errors: Errors,
    wanted_yield: float,
    worst: CoverageOfDesign,
    progress: Progress = lambda _: None,
    designs: SolvedDesigns | None = None,
) -> Margin:
    """The minimum margin with which the wanted share of builds covers enough.

    The spec's radii must follow rule traced. The loss of the worst camera hardly depends on the
    margin, so each try starts from the loss of the last one; smaller mirrors lose a little more,
    hence several tries.
    """
    designs = designs or solved_designs()
    target, tried, share = spec.optics.capture_diameter_mm, spec.mirrors.margin_mm, 0.0
    for _ in range(MAX_TRIES):
        progress(f"margin {tried:.2f} mm")
        try:
            seen = worst(errors, designs(with_margin(spec, tried)))
        except SpecError as error:
            return Margin(None, share, f"mirrors of margin {tried:.2f} mm: {error}")
        share = float((seen >= target).mean())
        shortfall = target - coverage_at_yield(seen, wanted_yield)
        if share >= wanted_yield and (shortfall > -STEP_MM or tried == 0):
            return Margin(tried, share)
        tried = max(0.0, round(ceil((tried + shortfall) / STEP_MM - 1e-9) * STEP_MM, 6))
        if tried > MAX_MARGIN:
            return Margin(None, share, f"it would need more than {MAX_MARGIN:g} mm")
    if share >= wanted_yield:
        return Margin(tried, share)
    return Margin(None, share, f"not found in {MAX_TRIES} tries")


def with_margin(spec: Spec, mm: float) -> Spec:
    """The spec with another margin, the same for all mirrors."""
    return spec_with(spec, mirrors={"margin_mm": round(mm, 6), "radius_rule": "traced"})


@dataclass(frozen=True)
class SeeingPixels:
    """Pixels of a virtual camera that see the capture sphere."""

    median: float
    minimum: float

    def __str__(self) -> str:
        return f"{self.median:.0f} (minimum {self.minimum:.0f})"


def seeing_pixels(spec: Spec) -> SeeingPixels:
    """Count the pixels of a design by one ray through each."""
    radius = spec.optics.capture_diameter_mm / 2
    pixels = virtual_camera_pixels(design(spec).arrays[0], radius)
    return SeeingPixels(float(np.median(pixels)), float(pixels.min()))


@dataclass(frozen=True)
class OwnMargins:
    """Margins of the m mirrors of one camera."""

    mm: Floats  # margin of each, (m,)
    average_mm: float  # of those that are not nearly flat, whose coverage is no more than they need
    share: float  # yield, of the builds judged, of the design with these margins


@dataclass(frozen=True)
class MirrorLosses:
    """Coverage that the m mirrors of both halves lose in s builds."""

    loss: Floats  # of mirror i of camera a, then of camera b, mm, (s, 2, m)
    spare: Floats  # loss that a nearly flat mirror may have, mm; others -inf, (m,)
    partner: Ints  # the mirror's image in y = 0, itself without such symmetry, (m,)

    @property
    def nearly_flat(self) -> Bools:
        """Mirrors that cover more than their targets, (m,)."""
        return np.isfinite(self.spare)


def own_margins(
    spec: Spec,
    errors: Errors,
    wanted_yield: float,
    even: float,
    coverage: CoverageOfDesign,
    progress: Progress = lambda _: None,
    designs: SolvedDesigns | None = None,
) -> OwnMargins | None:
    """Margins with which the wanted yield is reached, none below the spec's margin_mm.

    One margin for all mirrors, even (mm), is tried first; the spec's radii must follow rule traced.
    The first half of the builds is judged, the other sets means and deviations: builds that did
    both would seem enough more often than others are. None where no try was enough: margins too
    large, or mirrors that cannot be made.
    """
    designs = designs or solved_designs()
    target, best = spec.optics.capture_diameter_mm, None
    tried, attempt = np.full(1, even), with_margin(spec, even)
    for _ in range(MAX_ROUNDS):
        try:
            models = designs(attempt)
        except SpecError:
            break
        seen = coverage(errors, models)
        losses = mirror_losses(models, coverage(Errors(), models)[0], seen, target, tried)
        needed = np.maximum(needed_margins(losses, wanted_yield), spec.mirrors.margin_mm)
        share = float((seen[: len(seen) // 2].min(axis=1) >= target).mean())
        if attempt.mirrors.own_margins_mm and share >= wanted_yield:
            best = OwnMargins(tried, float(tried[~losses.nearly_flat].mean()), share)
            if (tried - needed).mean() < STEP_MM:
                break
        if needed.max() > MAX_MARGIN:
            break
        progress(f"margins {needed.min():.2f} to {needed.max():.2f} mm")
        tried, attempt = needed, with_own_margins(spec, needed)
    return best


def with_own_margins(spec: Spec, margins: Floats) -> Spec:
    """The spec with margins of single mirrors, mm, (m,)."""
    return spec_with(spec, mirrors={"own_margins_mm": tuple(np.round(margins, 6).tolist())})


def mirror_losses(
    models: EdgeModels, designed: Floats, seen: Floats, target: float, margins: Floats
) -> MirrorLosses:
    """Losses of each mirror, against coverage without errors (v,), in s builds (s, v), mm.

    The design has one margin, or its own for each mirror, mm, (1,) or (m,).
    """
    half, m = models[0], len(models[0])
    camera = virtual_camera_numbers(half.halved)
    loss = (designed - seen)[:, camera].reshape(len(seen), 2, m)
    beyond = designed[camera[:m]] - target
    spare = np.where(beyond > margins + FREE_MM, beyond, -np.inf)
    return MirrorLosses(loss, spare, _partners(half))


def needed_margins(losses: MirrorLosses, wanted_yield: float) -> Floats:
    """The least margins m + k s with which the wanted yield is reached, mm, (m,).

    The builds are the first half of those in the losses; m and s are those of the other half.
    Mirrors that are each other's image in y = 0 have the same margin, those of both cameras too:
    their losses are pooled. Mirrors that cover enough whatever their margin need none.
    """
    partner, judged = losses.partner, len(losses.loss) // 2
    loss, other = losses.loss[:judged], losses.loss[judged:]
    mean, deviation = _mean_and_sigma(np.concatenate([other, other[..., partner]], axis=1))
    level = np.where(loss > losses.spare, (loss - mean) / deviation, -np.inf).max(axis=(1, 2))
    k = -coverage_at_yield(-level, wanted_yield)
    margins = mean + k * deviation if np.isfinite(k) else np.zeros(len(mean))
    margins = np.where(margins > losses.spare, np.maximum(margins, 0.0), 0.0)
    steps = np.ceil(np.maximum(margins, margins[partner]) / STEP_MM - 1e-9)
    return np.asarray(np.round(steps * STEP_MM, 6))


def _mean_and_sigma(loss: Floats) -> tuple[Floats, Floats]:
    """Mean and rms deviation upwards of skew losses (..., m), mm, (m,) each."""
    every = loss.reshape(-1, loss.shape[-1])
    mean = every.mean(axis=0)
    above = np.sqrt((np.maximum(every - mean, 0) ** 2).mean(axis=0))
    return mean, np.maximum(above, KNOWN_MM)


def _partners(half: EdgeModel) -> Ints:
    u, m = np.round(half.screen[:, 2], DIRECTION_DIGITS) + 0.0, len(half)
    if half.view.pinhole[1] != 0:
        return np.arange(m)
    order, image_order = np.lexsort(u.T), np.lexsort((u * FLIP_Y + 0.0).T)
    partner = np.empty(m, dtype=np.int64)
    partner[order] = image_order
    return partner
