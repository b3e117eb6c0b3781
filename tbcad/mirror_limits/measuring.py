"""Which mirrors a workshop measures, and how exactly."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tbcad.core.geometry.vectors import norm
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.mirror_limits.held import mandrel_and_replica, radii_and_halves
from tbcad.mirror_limits.sensitivity import MM_PER_UM, MirrorLimits
from tbcad.tolerancing.process.chain import ChainStep
from tbcad.types import Floats, Ints

SAMPLES = 30  # of each half: a day of measuring, a judgement
GOOD = 0.99  # share of the mirrors that is said to be within limits
UNCERTAINTY_SHARE = 0.25  # of a limit that the expanded uncertainty may have: a judgement


def sampled(apex: Floats, limits: MirrorLimits, count: int = SAMPLES) -> Ints:
    """Numbers of the mirrors to measure in each half, rising, (k,): tight ones all over the shell.

    Apices are those of one half, mm, (m, 3). Each place is the farthest from all before, the first
    the tightest mirror's; of the mirrors nearest to a place the one with the smallest limits is
    measured, of both halves' by any kind against its median.
    """
    tight = (limits.each / np.median(limits.each, axis=0)).min(axis=1)
    tight = tight.reshape(2, -1).min(axis=0)
    nearest, owner = np.full(len(apex), np.inf), np.zeros(len(apex), dtype=np.int64)
    place = int(tight.argmin())
    for k in range(min(count, len(apex))):
        away = norm(apex - apex[place])
        owner = np.where(away < nearest, k, owner)
        nearest = np.minimum(nearest, away)
        place = int(nearest.argmax())
    groups = (np.flatnonzero(owner == k) for k in range(owner.max() + 1))
    return np.sort([mirrors[tight[mirrors].argmin()] for mirrors in groups])


def confidence(count: int, good: float = GOOD) -> float:
    """Confidence that a share of the mirrors is good when a number of random ones are."""
    return float(1 - good**count)


def height_uncertainty(export: ExportedDesign, limits: MirrorLimits) -> float:
    """Largest expanded uncertainty of heights with which all limits can be told, um.

    Of a cell of the half width h a tilt t lifts the rim by h t, a radius that is off by r by
    r h^2 / (2 R^2).
    """
    radius, half = radii_and_halves(export)
    ones = np.ones_like(half)
    lifted = np.stack([ones, half, (half / radius) ** 2 / (2 * MM_PER_UM), ones], axis=1)
    return UNCERTAINTY_SHARE * float((limits.each * lifted[:, : limits.each.shape[1]]).min())


def measurements(
    export: ExportedDesign, limits: MirrorLimits, steps: Sequence[ChainStep], share: Floats
) -> list[dict[str, Any]]:
    """The last instrument that steps name for the mandrel, if there is one, and for the shell.

    With the uncertainty that is required (um), and whether it has that. The mandrel may use a share
    (2 m, kinds) of the limits.
    """
    mandrel, replica = mandrel_and_replica(steps)
    parts = [("Mandrel", mandrel, limits.part(share))] if mandrel else []
    plan = []
    for solid, some, allowed in (*parts, ("Shell", replica, limits)):
        required = height_uncertainty(export, allowed)
        words, verdict = "No instrument is named", "agree on one"
        for one in (step.measured_with for step in some if step.measured_with):
            words = f"{one.value}, U {one.uncertainty_um:g} um"
            fine = one.uncertainty_um <= required
            verdict = "it does" if fine else "too coarse, name another in measured_with"
        row = {"solid": solid, "instrument": words, "required_um": required, "verdict": verdict}
        plan.append(row)
    return plan
