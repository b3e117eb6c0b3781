"""Contrast that the roughness of the balls leaves, by their grades.

A surface of roughness Rq sends 1 - exp(-(4 pi Rq cos(theta) / lambda)^2) of what it reflects past
the mirror's direction (total integrated scatter: Bennett and Porteus 1961; Beckmann). Rq is 1.25
Ra, as of normally distributed heights, and Ra the limit of the grade: balls on sale are often
better. What is scattered is a veil. If half of what shines on a ball from the directions that it is
scattered to is white and half is black, their contrast is what is not scattered.
"""

from __future__ import annotations

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import BALLS
from tbcad_verify.report.checks import Check, CheckName, at_least, worst_offenders
from tbcad_verify.types import Floats

# Largest Ra, micrometres (ISO 3290-1:2014, table 2).
RA_UM = {
    **{"G3": 0.010, "G5": 0.014, "G10": 0.020, "G16": 0.025, "G20": 0.032, "G24": 0.040},
    **{"G28": 0.050, "G40": 0.060, "G60": 0.080, "G100": 0.100, "G200": 0.150, "": 0.0},
}
RQ_OVER_RA, WAVELENGTH_UM = 1.25, 0.55
MIN_CONTRAST = 0.4  # as much as the lens leaves of the finest lines on the sensor; a judgement
FILE = BALLS
CHECKS = {"ball contrast": "1"}


def checks(names: list[CheckName], context: PrototypeContext) -> list[Check]:
    """The least contrast that a ball leaves; caps, which are polished as drawn, count as smooth."""
    balls = context.prototype.balls
    apex, normal = balls.columns("px", 3).T, balls.columns("nx", 3).T
    sight = context.pinhole - apex
    cosine = np.abs((normal * sight).sum(axis=1)) / np.linalg.norm(sight, axis=1)
    left = 1 - scattered(np.array([RA_UM[one] for one in balls.grade.tolist()]), cosine)
    ids = balls.names(np.arange(len(left)))
    rough = worst_offenders(ids, -left, "", left < MIN_CONTRAST, ".2f")
    return [at_least(names[0], float(left.min()), MIN_CONTRAST, rough)]


def scattered(ra_um: Floats, cosine: Floats) -> Floats:
    """Total integrated scatter of surfaces of Ra (N,) at cosines of incidence (N,)."""
    return np.asarray(-np.expm1(-((4 * np.pi * RQ_OVER_RA * ra_um * cosine / WAVELENGTH_UM) ** 2)))
