"""The design that a process needs: with the least margins, of single mirrors where that helps."""

from dataclasses import dataclass

import numpy as np

from tbcad.common import schedule
from tbcad.core.mirrors.array import design
from tbcad.core.spec.design import EdgeKind, Spec, spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.errors import InputError
from tbcad.options.builds import check_yield
from tbcad.options.captures import Optics
from tbcad.tolerancing.margin import (
    STEP_MM,
    SeeingPixels,
    margin,
    own_margins,
    seeing_pixels,
    solved_designs,
    with_margin,
    with_own_margins,
)
from tbcad.tolerancing.montecarlo.builds import CoverageCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.montecarlo.sharpness import view_ssims
from tbcad.tolerancing.process.process import Process, process_errors
from tbcad.types import Floats, Progress

# Simulated builds that the margins of a design are computed from, and their seed.
BUILDS = 400
SEED = 1
# Pixels that pedestals must leave, of those of valleys: margins from 400 builds are known so well
# that pixels are known to about a per cent, and valleys are simpler to make.
WORTH = 1.01


@dataclass(frozen=True)
class ProcessDesign:
    """A design with the margins that a process needs."""

    spec: Spec  # with margins of single mirrors, or with one for all where those gain nothing
    even_mm: float  # the one margin for all that reaches the same yield

    @property
    def is_even(self) -> bool:
        """Whether all mirrors have the same margin."""
        return not self.spec.mirrors.own_margins_mm


def design_for_process(
    spec: Spec, process: Process, wanted_yield: float, progress: Progress = lambda _: None
) -> ProcessDesign:
    """The same design but for the least margins with which a process reaches a yield.

    No mirror gets less than the spec's margin_mm. Margins of single mirrors are taken where they
    are smaller on average than one for all. InputError if no margin is enough, or radii follow no
    target.
    """
    check_margins_can_be_set(spec, wanted_yield)
    spec = spec_with(spec, mirrors={"own_margins_mm": ()})
    errors, designs = process_errors(process, spec.mirrors.coating_um), solved_designs()
    needed = margin(spec, errors, wanted_yield, _worst_coverage, progress, designs)
    if needed.mm is None:
        raise InputError(
            f"process {process.name} does not yield {wanted_yield:.1%} with any margin "
            f"({needed.reason}): choose a more exact one, or see tbcad tolerance"
        )
    if needed.mm <= spec.mirrors.margin_mm:
        return ProcessDesign(spec, spec.mirrors.margin_mm)
    own = own_margins(spec, errors, wanted_yield, needed.mm, _coverage, progress, designs)
    if own is None or own.average_mm > needed.mm - STEP_MM:
        return ProcessDesign(with_margin(spec, needed.mm), needed.mm)
    return ProcessDesign(with_own_margins(spec, own.mm), needed.mm)


def check_margins_can_be_set(spec: Spec, wanted_yield: float) -> None:
    """Refuse what no margins lead to: no share, and radii that follow no target."""
    check_yield(wanted_yield)
    if spec.mirrors.radius_rule != "traced":
        raise InputError(
            f"--process sets margins, which radii of rule {spec.mirrors.radius_rule} do not "
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
    """Pixels of a virtual camera that see the object, with these margins, others, and none."""
    specs = {"with none": with_margin(made.spec, 0.0)}
    if not made.is_even:
        specs = {"with one for all": with_margin(made.spec, made.even_mm)} | specs
    others = {words: seeing_pixels(one) for words, one in specs.items()}
    return {"with these margins": seen or seeing_pixels(made.spec)} | others


def costs_text(costs: dict[str, SeeingPixels]) -> str:
    """The same in words."""
    each = (f"{pixels} {words}" for words, pixels in costs.items())
    return f"pixels of a virtual camera that see the object, median: {', '.join(each)}"


def ssim_costs(made: ProcessDesign, optics: Optics = "real") -> dict[str, float]:
    """Mean SSIM of views as designed: with these margins, and with none."""
    specs = {"with these margins": made.spec, "with none": with_margin(made.spec, 0.0)}
    return view_ssims(specs, optics)


def ssim_text(costs: dict[str, float], optics: Optics = "real") -> str:
    """The same in words."""
    each = (f"{ssim:.3f} {words}" for words, ssim in costs.items())
    return f"SSIM of views of the knot, designed, {optics} optics: {', '.join(each)}"


def _worst_coverage(errors: Errors, models: EdgeModels) -> Floats:
    case = CoverageCase(models, errors, SEED, worst_only=True)
    return simulate(case, BUILDS, schedule.run_units).worst


def _coverage(errors: Errors, models: EdgeModels) -> Floats:
    return simulate(CoverageCase(models, errors, SEED), 2 * BUILDS, schedule.run_units).coverage


@dataclass(frozen=True)
class TriedEdges:
    """A design with one kind of edges, for a process."""

    edges: EdgeKind
    made: ProcessDesign | None  # with the margins needed; None: none, or too few pixels
    pixels: SeeingPixels | None  # of it, or the most that margins leave; None: no design
    error: InputError | None = None  # why there is no design, or None


@dataclass(frozen=True)
class EdgeChoice:
    """The design for a process, and the edges that were tried and not taken."""

    made: ProcessDesign
    pixels: SeeingPixels
    other: TriedEdges | None  # with other edges; None where the design says which edges it has


def edges_for_process(
    spec: Spec, process: Process, wanted_yield: float, progress: Progress = lambda _: None
) -> EdgeChoice:
    """The design whose least margins for a process and a yield leave most pixels (median).

    Edges that the design names stay; a process with a mandrel has valleys, as walls of pedestals
    catch, and the mandrel is built too. Else pedestals are taken where they leave a per cent more
    than valleys. Margins take pixels: where pedestals have too few even with the design's own
    margin, none are searched for. InputError as of `design_for_process`, with neither kind of
    edges, and where the mandrel's cutter is larger than a mirror's radius.
    """
    check_margins_can_be_set(spec, wanted_yield)
    if process.mandrel_cutter_mm is not None:
        edges = spec.shell.edges if _names_edges(spec) else "valley"
        spec = spec_with(spec, shell={"negative": True, "edges": edges})
    if _names_edges(spec):
        made = design_for_process(spec, process, wanted_yield, progress)
        if process.mandrel_cutter_mm is not None:
            _check_reach(made.spec, process, process.mandrel_cutter_mm)
        return EdgeChoice(made, seeing_pixels(made.spec), None)
    valley = _tried("valley", spec, process, wanted_yield, progress)
    pedestal = _too_few(spec, valley, progress) or _tried(
        "pedestal", spec, process, wanted_yield, progress
    )
    worth = _median(pedestal) >= WORTH * _median(valley)
    best, other = (pedestal, valley) if worth else (valley, pedestal)
    if best.made is None or best.pixels is None:
        raise valley.error or InputError(f"no edges suit process {process.name}")
    return EdgeChoice(best.made, best.pixels, other)


def _names_edges(spec: Spec) -> bool:
    return "edges" in spec.shell.model_fields_set


def _check_reach(spec: Spec, process: Process, cutter: float) -> None:
    """InputError where a cutter does not fit into the mandrel's pockets of the mirrors' radii."""
    smallest = 1 / design(spec).arrays[0].modelled_cells.surfaces.curvature.max()
    if cutter >= smallest:
        raise InputError(
            f"process {process.name}: the mandrel's cutter has a radius of {cutter:g} mm, allowed "
            f"is less than that of the smallest mirror, {smallest:.3g} mm: name a smaller one"
        )


def edges_text(choice: EdgeChoice) -> str:
    """The choice in words."""
    shell, other = choice.made.spec.shell, choice.other
    chosen, negative = shell.edges, shell.negative
    if other is None:
        reason = "with which a shell comes off its mandrel" if negative else "as the design says"
        return f"edges: {chosen}, {reason}"
    return (
        f"edges: {chosen}, with a median of {choice.pixels} pixels of a virtual camera; "
        f"{other.edges}: {_told(other)}"
    )


def _told(tried: TriedEdges) -> str:
    if tried.pixels is None:
        return "cannot be made" if isinstance(tried.error, SpecError) else "no margin is enough"
    return f"{'' if tried.made else 'at most '}{tried.pixels}"


def _median(tried: TriedEdges) -> float:
    return tried.pixels.median if tried.made and tried.pixels else 0.0


def _tried(
    edges: EdgeKind, spec: Spec, process: Process, wanted_yield: float, progress: Progress
) -> TriedEdges:
    """One kind of edges, with the margins that the process needs."""
    try:
        made = design_for_process(
            spec_with(spec, shell={"edges": edges}),
            process,
            wanted_yield,
            lambda text: progress(f"{edges}, {text}"),
        )
    except InputError as error:
        return TriedEdges(edges, None, None, error)
    return TriedEdges(edges, made, seeing_pixels(made.spec))


def _too_few(spec: Spec, valley: TriedEdges, progress: Progress) -> TriedEdges | None:
    """Pedestals without margins for the process, where that is enough to leave them."""
    if valley.pixels is None:
        return None
    progress("pedestal")
    bare = spec_with(spec, shell={"edges": "pedestal"}, mirrors={"own_margins_mm": ()})
    try:
        most = seeing_pixels(bare)
    except SpecError as error:
        return TriedEdges("pedestal", None, None, error)
    few = most.median < WORTH * valley.pixels.median
    return TriedEdges("pedestal", None, most) if few else None
