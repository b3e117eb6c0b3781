"""The design that a process needs: with the least margins, of single mirrors where that helps."""

from dataclasses import dataclass

import numpy as np

from tbcad import schedule
from tbcad.errors import InputError
from tbcad.spec.design import Spec, spec_with
from tbcad.tolerance.margin import STEP_MM, SolvedDesigns, margin, with_margin
from tbcad.tolerance.margin_pixels import SeeingPixels, seeing_pixels
from tbcad.tolerance.montecarlo.builds import CoverageCase, WorstCase, simulate
from tbcad.tolerance.montecarlo.edge_model import EdgeModels
from tbcad.tolerance.montecarlo.error_kinds import Errors
from tbcad.tolerance.own_margins import own_margins, with_own_margins
from tbcad.tolerance.process.process import Process, process_errors
from tbcad.tolerance.view_quality import view_ssims
from tbcad.tolerance.wanted_yield import check_yield
from tbcad.types import Floats, Progress

# Simulated builds that the margins of a design are computed from, and their seed.
BUILDS = 400
SEED = 1


@dataclass(frozen=True)
class ProcessDesign:
    """A design with the margins that a process needs.

    Attributes:
        spec: with margins of single mirrors, or with one for all where those gain nothing.
        even_mm: the one margin for all that reaches the same yield.
    """

    spec: Spec
    even_mm: float

    @property
    def is_even(self) -> bool:
        """Whether all mirrors have the same margin."""
        return not self.spec.mirrors.own_margins_mm


def design_for_process(
    spec: Spec, process: Process, wanted_yield: float, progress: Progress = lambda _: None
) -> ProcessDesign:
    """The same design but for the least margins with which a process reaches a yield.

    No mirror gets less than the spec's margin_mm. Margins of single mirrors are taken where they
    are smaller on average than one for all.

    Args:
        spec: the design.
        process: how it is made.
        wanted_yield: share of the builds that are to be good.
        progress: called with the margins that are tried.

    Raises:
        InputError: no margin is enough, or the radii do not follow a target.
    """
    check_margins_can_be_set(spec, wanted_yield)
    spec = spec_with(spec, mirrors={"own_margins_mm": ()})
    errors, designs = process_errors(process, spec.mirrors.coating_um), SolvedDesigns()
    needed = margin(spec, errors, wanted_yield, _worst_coverage, progress, designs)
    if needed.mm is None:
        raise InputError(
            f"process {process.name} does not make {wanted_yield:.1%} of the builds good with any "
            f"margin ({needed.reason}): choose a more exact one, or see tbcad tolerance"
        )
    if needed.mm <= spec.mirrors.margin_mm:
        return ProcessDesign(spec, spec.mirrors.margin_mm)
    own = own_margins(spec, errors, wanted_yield, needed.mm, _coverage, progress, designs)
    if own is None or own.average_mm > needed.mm - STEP_MM:
        return ProcessDesign(with_margin(spec, needed.mm), needed.mm)
    return ProcessDesign(with_own_margins(spec, own.mm), needed.mm)


def check_margins_can_be_set(spec: Spec, wanted_yield: float) -> None:
    """Refuse what no margins lead to: a share that is none, and radii that follow no target.

    Raises:
        InputError: one of these.
    """
    check_yield(wanted_yield)
    if spec.mirrors.radius_rule != "traced":
        raise InputError(
            f"--for-process sets margins, which radii of rule {spec.mirrors.radius_rule} do not "
            "follow: use --radius-rule traced"
        )


def margins_text(made: ProcessDesign) -> str:
    """The margins in words."""
    if made.is_even:
        return f"margin {made.spec.mirrors.margin_mm:g} mm"
    own = np.array(made.spec.mirrors.own_margins_mm)
    return (
        f"margins {own.min():.2f} to {own.max():.2f} mm, {own.mean():.2f} on average "
        f"(one for all mirrors: {made.even_mm:.2f})"
    )


def pixel_costs(made: ProcessDesign, seen: SeeingPixels | None = None) -> dict[str, SeeingPixels]:
    """Pixels of a virtual camera that see the object: with these margins, with others, with none.

    Args:
        made: the design.
        seen: its pixels, where they are known.

    Raises:
        SpecError: one of these designs cannot be made.
    """
    specs = {"with none": with_margin(made.spec, 0.0)}
    if not made.is_even:
        specs = {"with one for all": with_margin(made.spec, made.even_mm)} | specs
    others = {words: seeing_pixels(one) for words, one in specs.items()}
    return {"with these margins": seen or seeing_pixels(made.spec)} | others


def costs_text(costs: dict[str, SeeingPixels]) -> str:
    """The same in words."""
    each = (f"{pixels} {words}" for words, pixels in costs.items())
    return f"pixels of a virtual camera that see the object, median: {', '.join(each)}"


def ssim_costs(made: ProcessDesign) -> dict[str, float]:
    """Mean SSIM of views as designed: with these margins, and with none.

    Raises:
        SpecError: one of these designs cannot be made.
    """
    return view_ssims({"with these margins": made.spec, "with none": with_margin(made.spec, 0.0)})


def ssim_text(costs: dict[str, float]) -> str:
    """The same in words."""
    each = (f"{ssim:.3f} {words}" for words, ssim in costs.items())
    return f"SSIM of views of the knot, designed: {', '.join(each)}"


def _worst_coverage(errors: Errors, models: EdgeModels) -> Floats:
    return simulate(WorstCase(models, errors, SEED), BUILDS, schedule.run_units).worst


def _coverage(errors: Errors, models: EdgeModels) -> Floats:
    return simulate(CoverageCase(models, errors, SEED), 2 * BUILDS, schedule.run_units).coverage
