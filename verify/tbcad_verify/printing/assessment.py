"""One part on one machine: measurements, and the reasons why it cannot be made."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad_verify.printing.part_measures import PartMeasures, thin_area
from tbcad_verify.printing.placement import SLACK_MM, BedPlacement, place, pose_text
from tbcad_verify.printing.profile import Profile, load
from tbcad_verify.record.prototype import PrintedPart
from tbcad_verify.record.spec import PrinterSpec
from tbcad_verify.report.checks import Check, CheckName, at_most, finite, informative, require
from tbcad_verify.types import Floats

UNIT, OWN = "problems", "printable"
DIGITS = 9


@dataclass(frozen=True)
class PrintAssessment:
    """Whether one machine can make one part."""

    part: str  # name of the part's STL
    measures: PartMeasures  # of the part
    profile: Profile  # of the machine
    placement: BedPlacement  # how it lies in the machine, and overhangs
    # only for milled parts: length of inner edges in which a round tool leaves more than the
    # tolerance
    uncut_mm: float | None
    problems: tuple[str, ...]  # one sentence each; none: it can be made

    @property
    def mass_g(self) -> float:
        """Mass of the solid part."""
        return self.measures.mass.volume * self.profile.density_g_cm3 / 1000


def assess(part: str, measures: PartMeasures, profile: Profile) -> PrintAssessment:
    """Compare a part with a profile."""
    placement = place(measures, profile)
    problems = (*_mesh_problems(measures, profile), *_size_problems(measures, profile, placement))
    uncut = uncut_edge_length(measures, profile)
    return PrintAssessment(part, measures, profile, placement, uncut, problems)


def uncut_edge_length(measures: PartMeasures, profile: Profile) -> float | None:
    """Length of inner edges in which a round tool leaves more than the tolerance, mm.

    A tool of radius r that touches both faces of an edge that bends by beta stays away from the
    edge by r (1 / cos(beta / 2) - 1). None for processes without a tool.
    """
    if profile.process != "CNC":
        return None
    distance = profile.spot_mm / 2 * (1 / np.cos(measures.inner_edges.bend / 2) - 1)
    return float(measures.inner_edges.length[distance > profile.tolerance_mm].sum())


def to_row(one: PrintAssessment) -> dict[str, Any]:
    """All figures as JSON holds them, rounded to 9 digits; null for what was not found."""
    measures, pose, overhang = one.measures, one.placement.pose, one.placement.overhang
    mass, walls, holes = measures.mass, measures.walls, measures.holes
    wall = finite(walls.minimum)
    smallest = _smallest_hole(measures, one.profile)
    return {
        "part": one.part,
        "profile": one.profile.name,
        "process": one.profile.process,
        "material": one.profile.material,
        "volume_mm3": _rounded(mass.volume),
        "mass_g": _rounded(one.mass_g),
        "area_mm2": _rounded(mass.area),
        "centre_mm": _all_rounded(mass.centroid),
        "status": measures.status,
        "triangles": measures.triangles,
        "solids": measures.solids,
        "cavities": measures.cavities,
        "wall_mm": _rounded(wall),
        "wall_at_mm": None if wall is None else _all_rounded(walls.where.tolist()),
        "thin_mm2": _rounded(thin_area(walls, one.profile.wall_mm - SLACK_MM)),
        "hole_mm": None if smallest is None else _rounded(float(holes.diameter[smallest])),
        "hole_at_mm": (
            None if smallest is None else _all_rounded(holes.middle[:, smallest].tolist())
        ),
        "holes": holes.diameter.size,
        "fits": pose.fits,
        "too_large_mm": 0.0 if pose.fits else _rounded(pose.excess),
        "orientation": pose_text(pose),
        "rotation": [_all_rounded(row) for row in pose.rotation.tolist()],
        "size_mm": _all_rounded(pose.size.tolist()),
        "overhang_mm2": _rounded(overhang),
        "overhang_share": None if overhang is None else _rounded(overhang / mass.area),
        "inner_edges_mm": _rounded(one.uncut_mm),
        "problems": list(one.problems),
    }


def print_name(part: str, profile: Profile) -> CheckName:
    """Name, file and unit of the check of one part on one machine."""
    return f"print {profile.name}", part, UNIT


def print_check(one: PrintAssessment, required: bool) -> Check:
    """The check of one part on one machine."""
    name = print_name(one.part, one.profile)
    count, detail = float(len(one.problems)), "; ".join(one.problems)
    if required:
        return at_most(name, count, 0, detail)
    pose, material = pose_text(one.placement.pose), one.profile.material
    return informative(name, count, detail or f"fits: {pose}, {one.mass_g:.0f} g {material}")


def own_print_name(part: PrintedPart) -> CheckName:
    """Name, file and unit of the check of a prototype's part by the process that prints it."""
    return OWN, part.stl, UNIT


def own_print_checks(
    part: PrintedPart, printer: PrinterSpec, measures: PartMeasures | None, lost: str
) -> list[Check]:
    """Whether a prototype's part can be printed: a cap in resin, any other by FDM on a bed.

    Unknown: it was not measured, for the reason `lost`.
    """
    bed = {"bed_mm": tuple(printer.bed_mm), "clearance_mm": printer.bed_margin_mm}
    resin = part.role == "cap"
    profile = load("sla") if resin else load("fdm").model_copy(update=bed)
    problems = assess(part.stl, require(measures, lost), profile).problems
    detail = f"{profile.name}: {'; '.join(problems)}"
    return [at_most(own_print_name(part), len(problems), 0, detail)]


def _mesh_problems(measures: PartMeasures, profile: Profile) -> Iterator[str]:
    if measures.status != "NoError":
        yield f"no closed solid: manifold3d says {measures.status}"
    if measures.solids != 1:
        yield f"{measures.solids} separate solids, 1 allowed"
    if measures.cavities and not profile.cavities:
        yield f"{measures.cavities} closed cavities, none allowed"
    if profile.max_triangles is not None and measures.triangles > profile.max_triangles:
        yield f"{measures.triangles} triangles, at most {profile.max_triangles} are read"


def _size_problems(
    measures: PartMeasures, profile: Profile, placement: BedPlacement
) -> Iterator[str]:
    walls, holes, k = measures.walls, measures.holes, _smallest_hole(measures, profile)
    if walls.minimum < profile.wall_mm - SLACK_MM:
        yield f"minimum wall {_against(walls.minimum, profile.wall_mm)}, {_at(walls.where)}"
    if k is not None and holes.diameter[k] < profile.hole_mm - SLACK_MM:
        hole = _against(float(holes.diameter[k]), profile.hole_mm)
        yield f"smallest hole {hole}, {_at(holes.middle[:, k])}"
    if not placement.pose.fits:
        size, bed = _by(placement.pose.size), _by(profile.bed_mm)
        yield (
            f"{placement.pose.excess:.2f} mm too large: {size} with {pose_text(placement.pose)}, "
            f"the bed is {bed} less {profile.clearance_mm:g} at the rim"
        )


def _smallest_hole(measures: PartMeasures, profile: Profile) -> int | None:
    """Index of the smallest hole that is deeper than the machine's tolerance, None without one.

    A dimple that a machine may leave out is no hole: the flat at a cup's bottom is 2 um deep.
    """
    holes = measures.holes
    deep = np.flatnonzero(holes.depth > profile.tolerance_mm)
    return int(deep[holes.diameter[deep].argmin()]) if deep.size else None


def _against(measured: float, required: float) -> str:
    return f"{measured:.3g} mm, {required:g} required"


def _by(size: Sequence[float] | Floats) -> str:
    return " x ".join(f"{side:.5g}" for side in size)


def _at(point: Floats) -> str:
    return "at ({:.1f}, {:.1f}, {:.1f})".format(*(np.round(point, 1) + 0.0))


def _rounded(value: float | None) -> float | None:
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}") + 0.0


def _all_rounded(values: Sequence[float]) -> list[float | None]:
    return [_rounded(value) for value in values]
