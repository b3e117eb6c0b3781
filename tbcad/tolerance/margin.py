"""The margin on the design's target that a process needs, and the design that has it."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

from tbcad.mirrors.array import design
from tbcad.simulate.scene.reflector import reflectors
from tbcad.spec.design import MAX_MARGIN, Spec, spec_with
from tbcad.spec.errors import SpecError
from tbcad.tolerance.montecarlo.builds import coverage_at_yield
from tbcad.tolerance.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerance.montecarlo.error_kinds import Errors
from tbcad.types import Floats, Progress

WorstCoverageOfDesign = Callable[[Errors, EdgeModels], Floats]
"""Minimum coverage, mm, (s,), of builds of a design with some errors."""

MAX_TRIES = 6
STEP_MM = 0.01  # margins are rounded up to a multiple of it


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


class SolvedDesigns:
    """Fast models of designs with several margins, each solved once for all processes."""

    def __init__(self) -> None:
        """Begin without any design."""
        self._models: dict[Spec, EdgeModels | SpecError] = {}

    def of(self, spec: Spec) -> EdgeModels:
        """The fast model of a design.

        Raises:
            SpecError: the design cannot be made.
        """
        if spec not in self._models:
            try:
                self._models[spec] = edge_models(reflectors(design(spec)))
            except SpecError as error:
                self._models[spec] = error
        model = self._models[spec]
        if isinstance(model, SpecError):
            raise model
        return model


def margin(
    spec: Spec,
    errors: Errors,
    wanted_yield: float,
    worst: WorstCoverageOfDesign,
    progress: Progress = lambda _: None,
    designs: SolvedDesigns | None = None,
) -> Margin:
    """The minimum margin with which the wanted share of builds covers enough.

    Args:
        spec: the design; its radii must follow rule traced.
        errors: of the process.
        wanted_yield: share of good builds.
        worst: simulates builds.
        progress: called with each margin.
        designs: that other searches have solved; those of this one are added.

    The loss of the worst camera hardly depends on the margin, so each try starts from the loss of
    the last one; smaller mirrors lose a little more, hence several tries.
    """
    designs = designs or SolvedDesigns()
    target, tried, share = spec.optics.capture_diameter_mm, spec.mirrors.margin_mm, 0.0
    for _ in range(MAX_TRIES):
        progress(f"margin {tried:.2f} mm")
        try:
            seen = worst(errors, designs.of(with_margin(spec, tried)))
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
