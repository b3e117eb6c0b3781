"""Both halves of the data, calibrated apart: do they agree as well as their covariances say?

Halves share the prior. With informations I + A and I + B, prior standard deviations as the units,
the estimates' difference has the covariance C + D - C D - D C, where C and D are their inverses.
"""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.calibration.estimate.parameters import Block
from tbcad.calibration.estimate.solve import Estimate, estimate
from tbcad.calibration.uncertainty import ray_slopes
from tbcad.machine.machine import Highlights
from tbcad.types import Bools, Ints, Progress

MIN_HIGHLIGHTS = 10  # of a half
HALVES = {"angles": "frame", "LEDs": "led"}


@dataclass(frozen=True)
class Halves:
    """How two halves of the highlights agree, by rays at angles that are known.

    Attributes:
        by: what is apart: "angles" or "LEDs".
        counts: highlights of each half.
        found_mm: root mean square distance of both halves' rays at the object's centre.
        expected_mm: as their covariances say.
    """

    by: str
    counts: tuple[int, int]
    found_mm: float
    expected_mm: float

    @property
    def ratio(self) -> float:
        """Of what is found to what is expected."""
        return self.found_mm / self.expected_mm


def cross_validation(
    found: Estimate, frame: Ints, sphere: Ints, progress: Progress
) -> tuple[Halves, ...]:
    """Calibrate from every other frame and from the rest; the same with LEDs.

    Args:
        found: from all highlights; its outliers are left out.
        frame: of the rays that are compared, (m,).
        sphere: of the same, (m,).
        progress: called with the name of each half.
    """
    results = []
    for by, field in HALVES.items():
        even = getattr(found.highlights, field) % 2 == 0
        parts = [found.used & side for side in (even, ~even)]
        if min(part.sum() for part in parts) >= MIN_HIGHLIGHTS:
            results.append(_compared(found, by, parts, (frame, sphere), progress))
    return tuple(results)


def _compared(
    found: Estimate, by: str, parts: list[Bools], rays: tuple[Ints, Ints], progress: Progress
) -> Halves:
    progress(f"halves with {by} apart")
    one, other = (estimate(found.prior, _subset(found, part), start=found.values) for part in parts)
    slopes, _ = ray_slopes(found.prior, found.values, *rays)
    slopes = slopes[:, _static(found)]
    inverses = [np.linalg.inv(half.information.toarray()) for half in (one, other)]
    both = inverses[0] @ inverses[1]
    spread = (inverses[0] + inverses[1] - both - both.T)[np.ix_(_static(found), _static(found))]
    difference = slopes @ (one.values - other.values)[_static(found)]
    places = slopes.toarray().reshape(-1, 4, slopes.shape[1])[:, :2]
    expected = np.einsum("mdq,qr,mdr->", places, spread, places, optimize=True)
    squares = difference.reshape(-1, 4)[:, :2] ** 2
    count = len(squares)
    return Halves(
        by=by,
        counts=(len(one.highlights), len(other.highlights)),
        found_mm=math.sqrt(float(squares.sum()) / count),
        expected_mm=math.sqrt(float(expected) / count),
    )


def _static(found: Estimate) -> Ints:
    """Free parameters that are not of single frames, of which a half sees every other one."""
    prior = found.prior
    single = np.zeros(len(prior.flat_sigma), dtype=bool)
    for block in (Block.ANGLES, Block.RUNOUT):
        single[prior.first[block] : prior.first[block] + prior.sigma[block].size] = True
    return np.flatnonzero(~single[prior.free])


def _subset(found: Estimate, part: Bools) -> Highlights:
    h = found.highlights
    sigma = h.sigma[part] * found.noise_factor
    return Highlights(h.frame[part], h.sphere[part], h.led[part], h.pixel[part], sigma)
