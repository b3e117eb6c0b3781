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

WorstOf = Callable[[MirrorDesign, Errors], Floats]
"""Least coverage, mm, (s,), of machines made after a design with some errors."""

STEPS = 6
STEP_MM = 0.01  # margins are told in these, rounded up
MOST_MM = 20.0  # as in the design's keys


@dataclass(frozen=True)
class Margin:
    """What a process needs.

    Attributes:
        mm: margin beyond the capture diameter; None where none that can be made is enough.
        share: of good machines at that margin, or at the largest one tried.
        reason: why there is none, else "".
    """

    mm: float | None
    share: float
    reason: str = ""


def check_share(wanted: float) -> None:
    """Refuse a share of good machines that cannot be asked for.

    Raises:
        InputError: it is none.
    """
    if not 0 < wanted < 1:
        raise InputError(f"--yield {wanted:g}: allowed is above 0, below 1, like 0.99")


def margin(
    spec: Spec,
    errors: Errors,
    wanted: float,
    worst: WorstOf,
    progress: Progress = lambda _: None,
) -> Margin:
    """The least margin with which the wanted share of machines sees enough.

    Args:
        spec: the design; its radii must follow rule traced.
        errors: what the process does.
        wanted: share of good machines.
        worst: what machines see.
        progress: told of each margin.

    What the worst camera loses hardly depends on the margin, so each try starts from what the last
    one lost; smaller mirrors lose a little more, hence several.
    """
    target, now, share = spec.optics.capture_diameter_mm, spec.mirrors.margin_mm, 0.0
    for _ in range(STEPS):
        progress(f"margin {now:.2f} mm")
        try:
            seen = worst(design(with_margin(spec, now)), errors)
        except SpecError as error:
            return Margin(None, share, f"mirrors of margin {now:.2f} mm: {error}")
        share = float((seen >= target).mean())
        lacking = target - coverage_at_yield(seen, wanted)
        if share >= wanted and (lacking > -STEP_MM or now == 0):
            return Margin(now, share)
        now = max(0.0, round(ceil((now + lacking) / STEP_MM - 1e-9) * STEP_MM, 6))
        if now > MOST_MM:
            return Margin(None, share, f"it would need more than {MOST_MM:g} mm")
    return Margin(now, share) if share >= wanted else Margin(None, share, "the tries ran out")


def with_margin(spec: Spec, mm: float) -> Spec:
    """The spec with another margin."""
    mirrors = spec.mirrors.model_copy(update={"margin_mm": round(mm, 6), "radius_rule": "traced"})
    return spec.model_copy(update={"mirrors": mirrors})
