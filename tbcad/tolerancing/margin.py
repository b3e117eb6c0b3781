"""The margin on the design's target that a process needs, and the design that has it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import ceil
from typing import TypeAlias

import numpy as np

from tbcad.core.mirrors.array import MirrorArray, design
from tbcad.core.spec.design import MAX_MARGIN, Spec, spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.light.simulate.capture.photograph import Sensor, count_pixels
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.montecarlo.builds import coverage_at_yield
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.types import Floats, Progress

WorstCoverageOfDesign = Callable[[Errors, EdgeModels], Floats]
"""Minimum coverage, mm, (s,), of builds of a design with some errors."""

MAX_TRIES = 6
STEP_MM = 0.01  # margins are rounded up to a multiple of it


@dataclass(frozen=True)
class Margin:
    """The margin that a process needs."""

    mm: float | None  # margin beyond the capture diameter; None where no feasible margin is enough
    share: float  # of good builds at that margin, or at the last one tried
    reason: str = ""  # why there is none, else ""


SolvedDesigns: TypeAlias = Callable[[Spec], EdgeModels]
"""The fast model of a design, or a SpecError; each is solved once."""


def solved_designs() -> SolvedDesigns:
    """Fast models of designs with several margins, for all processes."""
    return cache(lambda spec: edge_models(reflectors(design(spec))))


def margin(
    spec: Spec,
    errors: Errors,
    wanted_yield: float,
    worst: WorstCoverageOfDesign,
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
        """Both, as text."""
        return f"{self.median:.0f} (minimum {self.minimum:.0f})"


def seeing_pixels(spec: Spec) -> SeeingPixels:
    """Count the pixels of a design by one ray through each."""
    radius = spec.optics.capture_diameter_mm / 2
    pixels = pixels_of_cameras(design(spec).arrays[0], radius)
    return SeeingPixels(float(np.median(pixels)), float(pixels.min()))


def pixels_of_cameras(array: MirrorArray, radius: float) -> Floats:
    """Pixels that see a capture sphere, over the v virtual cameras of both halves, (v,).

    The array is camera a's; both halves of a mirror on the seam count together.
    """
    camera = array.camera
    sensor = Sensor(camera.width_px, camera.height_px)
    seen = count_pixels(array, (sensor,), radius)[0].seen
    halved = array.u[:, 0] == 0
    return np.concatenate([np.where(halved, 2 * seen, seen), seen[~halved]])
