"""Recorded radii and coverages against the rule of the spec.

Rule "traced" gives every mirror the coverage that is asked for, with the margin of the spec or one
of its own, unless the mirror has the largest radius allowed; "paper" gives it the radius of
equation 2; "flat" gives it none.
"""

from __future__ import annotations

import numpy as np

from tbcad_verify.record.export import Export
from tbcad_verify.report.checks import Check, at_most, worst_offenders
from tbcad_verify.types import Bools, Floats

RULE_MM = 1e-3  # by which a coverage may be off; the search for radii ends at a tenth of it
RULE_SHARE = 1e-6  # of a radius
RULE = ("radius rule", "mirrors.csv", "mirrors")


def rule_check(export: Export) -> Check:
    """The radii are those of the spec's rule, margin and largest radius."""
    mirrors, rule = export.mirrors, export.spec.mirrors.radius_rule
    good = {"flat": _flat, "paper": _paper, "traced": _traced}[rule](export)
    detail = worst_offenders(mirrors.ids, mirrors.radius_mm, "mm", ~good, ".6g")
    return at_most(RULE, int((~good).sum()), 0, f"radii not by rule {rule}: {detail}")


def _flat(export: Export) -> Bools:
    return export.mirrors.flat


def _paper(export: Export) -> Bools:
    """Equation 2 of the paper, where it gives a radius and none above the largest."""
    mirrors, largest = export.mirrors, _largest(export)
    half = np.radians(mirrors.theta1_deg - mirrors.theta0_deg) / 2
    curvature = np.maximum(np.sin(half) / mirrors.size_mm, 1 / largest)
    return np.asarray(np.abs(mirrors.radius_mm * curvature - 1) <= RULE_SHARE)


def _traced(export: Export) -> Bools:
    mirrors, largest = export.mirrors, _largest(export)
    margin = _margins(export)
    beyond = mirrors.coverage_mm - (export.target_mm + margin)
    # Where spheres of the largest radius would not meet, tbcad makes them flatter still.
    at_largest = mirrors.radius_mm >= largest * (1 - RULE_SHARE)
    good = (np.abs(beyond) <= RULE_MM) | (at_largest & (beyond >= -RULE_MM))
    return np.asarray(good & (margin >= export.spec.mirrors.margin_mm))


def _margins(export: Export) -> Floats:
    """(M,) margin of each mirror, mm; NaN where there are own margins for another number of them.

    Both cameras' mirrors have the same, in the order of the file.
    """
    mirrors, own = export.mirrors, export.spec.mirrors.own_margins_mm
    if not own:
        return np.full(len(mirrors.camera), export.spec.mirrors.margin_mm)
    margins = np.full(len(mirrors.camera), np.nan)
    for camera in set(mirrors.camera.tolist()):
        rows = np.flatnonzero(mirrors.camera == camera)
        if len(rows) == len(own):
            margins[rows] = own
    return margins


def _largest(export: Export) -> Floats:
    """(M,) largest radius of each mirror, mm."""
    return export.spec.mirrors.max_radius_widths * export.mirrors.size_mm
