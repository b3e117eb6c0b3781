"""The margin on the design's target that a process needs."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.tolerance.montecarlo.builds import coverage_at_yield
from tbcad.tolerance.montecarlo.draws import Errors
from tbcad.types import Floats, Progress

WorstCoverageOfDesign = Callable[[MirrorDesign, Errors], Floats]
"""Minimum coverage, mm, (s,), of builds of a design with some errors."""

MAX_TRIES = 6
STEP_MM = 0.01  # margins are rounded up to a multiple of it
LARGEST_MARGIN_MM = 20.0  # as in the design's keys


@dataclass(frozen=True)
class Margin:
    """The margin that a process needs.

    Attributes:
        mm: margin beyond the capture diameter; None where no feasible margin is enough.
        share: of good builds at that margin, or at the last one tried.
        reason: why there is none, else "".
    """

    mm: float | None
    share: float
    reason: str = ""


def check_yield(wanted_yield: float) -> None:
    """Refuse a share of good builds that is not between 0 and 1.

    Raises:
        InputError: it is not.
    """
    if not 0 < wanted_yield < 1:
        raise InputError(f"--yield {wanted_yield:g}: allowed is above 0, below 1, like 0.99")


def margin(
    spec: Spec,
    errors: Errors,
    wanted_yield: float,
    worst: WorstCoverageOfDesign,
    progress: Progress = lambda _: None,
) -> Margin:
    """The minimum margin with which the wanted share of builds covers enough.

    Args:
        spec: the design; its radii must follow rule traced.
        errors: of the process.
        wanted_yield: share of good builds.
        worst: simulates builds.
        progress: called with each margin.

    The loss of the worst camera hardly depends on the margin, so each try starts from the loss of
    the last one; smaller mirrors lose a little more, hence several tries.
    """
    target, tried, share = spec.optics.capture_diameter_mm, spec.mirrors.margin_mm, 0.0
    for _ in range(MAX_TRIES):
        progress(f"margin {tried:.2f} mm")
        try:
            seen = worst(design(with_margin(spec, tried)), errors)
        except SpecError as error:
            return Margin(None, share, f"mirrors of margin {tried:.2f} mm: {error}")
        share = float((seen >= target).mean())
        shortfall = target - coverage_at_yield(seen, wanted_yield)
        if share >= wanted_yield and (shortfall > -STEP_MM or tried == 0):
            return Margin(tried, share)
        tried = max(0.0, round(ceil((tried + shortfall) / STEP_MM - 1e-9) * STEP_MM, 6))
        if tried > LARGEST_MARGIN_MM:
            return Margin(None, share, f"it would need more than {LARGEST_MARGIN_MM:g} mm")
    if share >= wanted_yield:
        return Margin(tried, share)
    return Margin(None, share, f"not found in {MAX_TRIES} tries")


def with_margin(spec: Spec, mm: float) -> Spec:
    """The spec with another margin."""
    mirrors = spec.mirrors.model_copy(update={"margin_mm": round(mm, 6), "radius_rule": "traced"})
    return spec.model_copy(update={"mirrors": mirrors})
