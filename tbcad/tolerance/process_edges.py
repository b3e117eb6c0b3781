"""The edges that leave most pixels with the margins that a process needs: valleys or pedestals."""

from dataclasses import dataclass

from tbcad.errors import InputError
from tbcad.spec.design import EdgeKind, Spec, spec_with
from tbcad.spec.errors import SpecError
from tbcad.tolerance.margin_pixels import SeeingPixels, seeing_pixels
from tbcad.tolerance.process.process import Process
from tbcad.tolerance.process_design import (
    ProcessDesign,
    check_margins_can_be_set,
    design_for_process,
)
from tbcad.types import Progress

# Pixels that pedestals must leave, of those of valleys: margins from 400 builds are known so well
# that pixels are known to about a per cent, and valleys are simpler to make.
WORTH = 1.01


@dataclass(frozen=True)
class TriedEdges:
    """A design with one kind of edges, for a process.

    Attributes:
        edges: their kind.
        made: with the margins that the process needs; None where there are none, or where even
            without them too few pixels are left.
        pixels: of a virtual camera of it, or of the most that any margins leave; None where there
            is no design.
        error: why there is no design, or None.
    """

    edges: EdgeKind
    made: ProcessDesign | None
    pixels: SeeingPixels | None
    error: InputError | None = None


@dataclass(frozen=True)
class EdgeChoice:
    """The design for a process, and the edges that were tried and not taken.

    Attributes:
        made: the design.
        pixels: of a virtual camera of it.
        other: with other edges; None where the design says which edges it has.
    """

    made: ProcessDesign
    pixels: SeeingPixels
    other: TriedEdges | None


def edges_for_process(
    spec: Spec, process: Process, wanted_yield: float, progress: Progress = lambda _: None
) -> EdgeChoice:
    """The design whose least margins for a process and a yield leave most pixels (median).

    Edges that the design names stay. Else pedestals are taken where they leave a per cent more than
    valleys. Margins take pixels: where pedestals have too few even with the design's own margin,
    none are searched for.

    Args:
        spec: the design as it was read, which knows what keys were given.
        process: how it is made.
        wanted_yield: share of the builds that are to be good.
        progress: called with what is tried.

    Raises:
        InputError: as `design_for_process`, with neither kind of edges.
    """
    check_margins_can_be_set(spec, wanted_yield)
    if "edges" in spec.shell.model_fields_set:
        made = design_for_process(spec, process, wanted_yield, progress)
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


def edges_text(choice: EdgeChoice) -> str:
    """The choice in words."""
    chosen, other = choice.made.spec.shell.edges, choice.other
    if other is None:
        return f"edges: {chosen}, as the design says"
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
