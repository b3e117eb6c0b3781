"""No ball touches another: they turn together, so the gaps between them are those at any angle."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from tbcad_verify.prototype.bodies import MeasuredPrototype
from tbcad_verify.report.checks import Check, CheckName, at_least, worst_offenders

FILE = ("base", "cap")
CHECKS = {"balls apart": "mm"}
ROUNDING_MM = 1e-3  # of places that pads of float32 give


def checks(names: list[CheckName], measured: MeasuredPrototype) -> list[Check]:
    """Least gap between two balls where their pads put them, against the spec's wall."""
    context, radius = measured.context, measured.body_radius
    gaps = cdist(measured.body.T, measured.body.T) - radius[:, None] - radius
    np.fill_diagonal(gaps, np.inf)
    least = gaps.min(axis=1)
    wall = float(context.export.spec.prototype.ball_wall_mm)
    ids = context.prototype.balls.names(np.arange(len(radius)))
    near = worst_offenders(ids, least, "mm", least < wall - ROUNDING_MM, ".3f", -least)
    return [at_least(names[0], float(least.min()), wall - ROUNDING_MM, f"gaps: {near}")]
