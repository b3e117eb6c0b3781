"""Radii, areas and coverage of mirrors.csv, against the spec, the closed form, and rays.

Of the radii, rule "traced" gives every mirror the coverage that is asked for, with the margin of
the spec or one of its own, unless the mirror has the largest radius allowed; "paper" gives it the
radius of equation 2; "flat" gives it none.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tbcad_verify.record.export import Export
from tbcad_verify.report.checks import Check, at_most, guarded, require, worst_offenders
from tbcad_verify.step.front_checks import CELL_SHARE, worst_of
from tbcad_verify.step.pedestals import Grooves
from tbcad_verify.step.sphere_union import cells_of_export
from tbcad_verify.types import Bools, Floats

COVERAGE_MM = 0.1  # spheres fitted to coarse facets, and outlines between their corners
COVERAGE = ("recorded coverage", "mirrors.csv", "mm")
AREAS = ("cell areas", "mirrors.csv", "of the area")
RULE_MM = 1e-3  # by which a coverage may be off; the search for radii ends at a tenth of it
RULE_SHARE = 1e-6  # of a radius
RULE = ("radius rule", "mirrors.csv", "mirrors")


def area_checks(export: Export, grooves: Mapping[str, Grooves | None]) -> list[Check]:
    """The check of the recorded areas, which takes long; with the grooves of each camera."""
    return guarded([AREAS], lambda: [_areas(export, grooves)])


def radius_checks(export: Export, coverage: Floats | None) -> list[Check]:
    """The checks of the recorded radii and of their coverage (M,), mm, as measured on spheres."""
    rule = guarded([RULE], lambda: [rule_check(export)])
    return rule + guarded([COVERAGE], lambda: [_coverage(export, coverage)])


def _areas(export: Export, grooves: Mapping[str, Grooves | None]) -> Check:
    """Areas of the reflecting surfaces as recorded, against the closed form of the spheres."""
    mirrors, area = export.mirrors, np.full(len(export.mirrors), np.nan)
    for camera in export.cameras:
        cells = cells_of_export(export, camera, grooves.get(camera), coated=True)
        area[mirrors.camera == camera] = cells.area
    error = np.abs(mirrors.cell_area_mm2 / area - 1)
    return worst_of(AREAS, mirrors.ids, error, CELL_SHARE, "of its area off")


def _coverage(export: Export, coverage: Floats | None) -> Check:
    """Coverage as recorded, against what rays found."""
    error = np.abs(export.mirrors.coverage_mm - require(coverage, "coverage was not measured"))
    return worst_of(COVERAGE, export.mirrors.ids, error, COVERAGE_MM, "mm")


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
    mirrors, margin = export.mirrors, _margins(export)
    beyond = mirrors.coverage_mm - (export.target_mm + margin)
    # Where spheres of the largest radius would not meet, tbcad halves the least curvature of all.
    flatter = mirrors.radius_mm / _largest(export)
    halvings = np.log2(np.max(flatter, initial=1.0))
    good = (np.abs(beyond) <= RULE_MM) | ((flatter >= 1 - RULE_SHARE) & (beyond >= -RULE_MM))
    if abs(halvings - np.round(halvings)) > RULE_SHARE:
        good &= flatter <= 1 + RULE_SHARE
    return np.asarray(good & (margin >= export.spec.mirrors.margin_mm))


def _margins(export: Export) -> Floats:
    """(M,) margin of each mirror, mm; NaN where there are own margins for another number of them.

    Both cameras' mirrors have the same, in the order of the file.
    """
    mirrors, own = export.mirrors, export.spec.mirrors.own_margins_mm
    if not own:
        return np.full(len(mirrors), export.spec.mirrors.margin_mm)
    margins = np.full(len(mirrors), np.nan)
    for camera in set(mirrors.camera.tolist()):
        rows = np.flatnonzero(mirrors.camera == camera)
        if len(rows) == len(own):
            margins[rows] = own
    return margins


def _largest(export: Export) -> Floats:
    """(M,) largest radius of each mirror, mm."""
    return export.spec.mirrors.max_radius_widths * export.mirrors.size_mm
