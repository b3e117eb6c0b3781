"""A STEP file compared with the mesh, the record, the closed form, and its own claims.

Of the radii, rule "traced" gives every mirror the coverage that is asked for, with the margin of
the spec or one of its own, unless the mirror has the largest radius allowed; "paper" gives it the
radius of equation 2; "flat" gives it none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.record.export import Export, Part
from tbcad_verify.record.flange_holes import HoleLimits, flanges, hole_faults
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    attempt,
    guarded,
    require,
    short_list,
    worst_offenders,
)
from tbcad_verify.step.front_checks import (
    CELL_SHARE,
    FrontComparison,
    each_checked,
    each_compared,
    front_fields,
    worst_of,
)
from tbcad_verify.step.front_checks import CHECKS as FRONT_CHECKS
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.part_checks import (
    MASS_CHECKS,
    SOLID_CHECKS,
    Checks,
)
from tbcad_verify.step.pedestals import Grooves, fronts
from tbcad_verify.step.solids_text import Casing, read_casing, wall
from tbcad_verify.step.sphere_union import cells_of_export
from tbcad_verify.step.step_file import StepFile, known, load
from tbcad_verify.types import Bools, Floats

WALL_MM = 1e-3  # the deepest point may lie between corners
HOLE_LIMITS = HoleLimits(size=1e-6, place=1e-3)  # lengths along a section are sums of chords
COVERAGE_MM = 0.1  # spheres fitted to coarse facets, and outlines between their corners
COVERAGE = ("recorded coverage", "mirrors.csv", "mm")
AREAS = ("cell areas", "mirrors.csv", "of the area")
RULE_MM = 1e-3  # by which a coverage may be off; the search for radii ends at a tenth of it
RULE_SHARE = 1e-6  # of a radius
RULE = ("radius rule", "mirrors.csv", "mirrors")


@dataclass(frozen=True, kw_only=True)
class ShellComparison(FrontComparison):
    """A shell's STEP file and all that it is compared with."""

    casing: Casing  # back and holes
    wall: float | Unknown  # thickness behind the deepest valley, mm


def shell_comparisons(
    export: Export, files: dict[str, StepFile | Unknown]
) -> dict[str, ShellComparison | Unknown]:
    """Each shell's STEP file with all that it is compared with but its mesh, or why not."""
    return each_compared(export.parts, files, partial(_comparison, export))


def shell_step_checks(
    export: Export,
    masses: dict[str, MassProperties],
    comparisons: dict[str, ShellComparison | Unknown],
    coverage: Floats | None,
    areas: Sequence[Check],
) -> list[Check]:
    """All checks of all STEP files that the record names.

    `coverage`: (M,) mm, as measured on spheres.
    """
    checks = each_checked(export, export.parts, CHECKS, masses, comparisons)
    recorded = [*areas]
    recorded += guarded([RULE], lambda: [rule_check(export)])
    recorded += guarded([COVERAGE], lambda: [_recorded_coverage(export, coverage)])
    return recorded + checks


def area_checks(export: Export, grooves: Mapping[str, Grooves | None]) -> list[Check]:
    """The check of the recorded areas, which takes long; with the grooves of each camera."""
    return guarded([AREAS], lambda: [_recorded_areas(export, grooves)])


def _recorded_areas(export: Export, grooves: Mapping[str, Grooves | None]) -> Check:
    """Areas of the reflecting surfaces as recorded, against the closed form of the spheres."""
    mirrors, area = export.mirrors, np.full(len(export.mirrors), np.nan)
    for camera in export.cameras:
        cells = cells_of_export(export, camera, grooves.get(camera), coated=True)
        area[mirrors.camera == camera] = cells.area
    error = np.abs(mirrors.cell_area_mm2 / area - 1)
    return worst_of(AREAS, mirrors.ids, error, CELL_SHARE, "of its area off")


def _recorded_coverage(export: Export, coverage: Floats | None) -> Check:
    """Coverage as recorded, against what rays found."""
    measured = require(coverage, "coverage was not measured")
    error = np.abs(export.mirrors.coverage_mm - measured)
    return worst_of(COVERAGE, export.mirrors.ids, error, COVERAGE_MM, "mm")


def _comparison(export: Export, part: Part, read: StepFile | Unknown) -> ShellComparison:
    file, table = known(read), StepTable(load(export.folder, part.step).text())
    fields = front_fields(export, part, file, table, file.faces)
    casing = read_casing(table, fronts(file.faces.names, frozenset(fields["mirrors"].ids)))
    thickness, no_wall = attempt(lambda: wall(casing, fields["camera"], export.semi_minor_mm))
    thick = Unknown(no_wall) if thickness is None else thickness
    return ShellComparison(**fields, casing=casing, wall=thick)


def _wall(name: CheckName, shell: ShellComparison) -> Check:
    """Material behind the deepest valley, as the spec has it."""
    asked = shell.export.spec.shell.wall_mm
    measured = known(shell.wall)
    detail = f"the wall is {measured:.3f} mm, the spec has {asked:g}"
    return at_most(name, abs(measured - asked), WALL_MM, detail)


def _holes(name: CheckName, shell: ShellComparison) -> Check:
    """Bolt and dowel holes, as the spec has them."""
    beyond = shell.casing.semi_axes[1] - shell.export.semi_minor_mm
    wanted = flanges(shell.export, shell.camera, beyond)
    faults = hole_faults(shell.casing.holes, wanted, HOLE_LIMITS)
    return at_most(name, len(faults), 0, short_list(faults))


CHECKS: Checks = {
    **SOLID_CHECKS,
    **FRONT_CHECKS,
    "step wall": ("mm", _wall),
    "step holes": ("faults", _holes),
    **MASS_CHECKS,
}


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
    # Where spheres of the largest radius would not meet, tbcad halves the least curvature of all.
    flatter = mirrors.radius_mm / largest
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
