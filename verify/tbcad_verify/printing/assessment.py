"""One part held against one profile: figures, and what keeps it from being made."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad_verify.printing.part_measures import PartMeasures
from tbcad_verify.printing.placement import SLACK_MM, Placement, place, pose_text
from tbcad_verify.printing.profile import Profile
from tbcad_verify.printing.walls import thin_area
from tbcad_verify.report.checks import Check, CheckName, at_most, finite, informative
from tbcad_verify.types import Floats

UNIT = "problems"
DIGITS = 9


@dataclass(frozen=True)
class PrintAssessment:
    """What making one part on one machine comes to. What could not be found is None.

    Attributes:
        part: name of the part's STL.
        profile: the machine.
        volume_mm3: of material.
        mass_g: of material, solid.
        area_mm2: of the surface.
        centre_mm: (3,) centre of gravity.
        status: manifold3d's word.
        triangles: how many.
        solids: separate pieces.
        cavities: closed in.
        wall_mm: least thickness.
        wall_at_mm: (3,) middle of the thinnest wall.
        thin_mm2: surface over walls that are too thin, both sides counted.
        hole_mm: diameter of the smallest round hole.
        hole_at_mm: (3,) middle of it.
        holes: how many round ones.
        placing: how it lies, and overhangs.
        inner_edges_mm: only for machined parts: length of inner edges in which a round tool leaves
            more than the tolerance.
        problems: one sentence each; none: it can be made.
    """

    part: str
    profile: Profile
    volume_mm3: float
    mass_g: float
    area_mm2: float
    centre_mm: Sequence[float]
    status: str
    triangles: int
    solids: int
    cavities: int
    wall_mm: float | None
    wall_at_mm: Sequence[float] | None
    thin_mm2: float
    hole_mm: float | None
    hole_at_mm: Sequence[float] | None
    holes: int
    placing: Placement
    inner_edges_mm: float | None
    problems: tuple[str, ...]


def assess(part: str, shape: PartMeasures, profile: Profile) -> PrintAssessment:
    """Hold a part against a profile.

    Args:
        part: name of its STL in the export.
        shape: what `measure` found.
        profile: the machine.
    """
    holes, wall = shape.holes, finite(shape.walls.least)
    smallest = int(holes.diameter.argmin()) if holes.diameter.size else None
    placing = place(shape, profile)
    return PrintAssessment(
        part=part,
        profile=profile,
        volume_mm3=shape.mass.volume,
        mass_g=shape.mass.volume * profile.density_g_cm3 / 1000,
        area_mm2=shape.mass.area,
        centre_mm=shape.mass.centroid,
        status=shape.status,
        triangles=shape.triangles,
        solids=shape.pieces.solids,
        cavities=shape.pieces.cavities,
        wall_mm=wall,
        wall_at_mm=None if wall is None else shape.walls.where.tolist(),
        thin_mm2=thin_area(shape.walls, profile.wall_mm - SLACK_MM),
        hole_mm=None if smallest is None else float(holes.diameter[smallest]),
        hole_at_mm=None if smallest is None else holes.middle[:, smallest].tolist(),
        holes=holes.diameter.size,
        placing=placing,
        inner_edges_mm=uncut_edge_length(shape, profile),
        problems=(*_of_mesh(shape, profile), *_of_size(shape, profile, placing)),
    )


def uncut_edge_length(shape: PartMeasures, profile: Profile) -> float | None:
    """Length of inner edges in which a round tool leaves more than the tolerance, mm.

    A tool of radius r that touches both faces of an edge that bends by beta stays away from the
    edge by r (1 / cos(beta / 2) - 1). None for processes without a tool.
    """
    if profile.process != "machined":
        return None
    left = profile.spot_mm / 2 * (1 / np.cos(shape.inner_edges.bend / 2) - 1)
    return float(shape.inner_edges.length[left > profile.tolerance_mm].sum())


def checks(prints: Sequence[PrintAssessment], wanted: bool) -> list[Check]:
    """One line for each part and profile.

    Args:
        prints: assessed.
        wanted: whether the user asked for these machines: then a problem fails, else it is told.
    """
    return [_check(one, wanted) for one in prints]


def to_row(one: PrintAssessment) -> dict[str, Any]:
    """Everything as JSON holds it, rounded to 9 digits."""
    pose, area = one.placing.pose, one.placing.overhang
    return {
        "part": one.part,
        "profile": one.profile.name,
        "process": one.profile.process,
        "material": one.profile.material,
        "volume_mm3": _short(one.volume_mm3),
        "mass_g": _short(one.mass_g),
        "area_mm2": _short(one.area_mm2),
        "centre_mm": _shorts(one.centre_mm),
        "status": one.status,
        "triangles": one.triangles,
        "solids": one.solids,
        "cavities": one.cavities,
        "wall_mm": _short(one.wall_mm),
        "wall_at_mm": _shorts(one.wall_at_mm),
        "thin_mm2": _short(one.thin_mm2),
        "hole_mm": _short(one.hole_mm),
        "hole_at_mm": _shorts(one.hole_at_mm),
        "holes": one.holes,
        "fits": one.placing.fits,
        "too_large_mm": 0.0 if one.placing.fits else _short(pose.excess),
        "orientation": pose_text(pose),
        "rotation": [_shorts(row) for row in pose.rotation.tolist()],
        "size_mm": _shorts(pose.size.tolist()),
        "overhang_mm2": _short(area),
        "overhang_share": None if area is None else _short(area / one.area_mm2),
        "inner_edges_mm": _short(one.inner_edges_mm),
        "problems": list(one.problems),
    }


def print_name(part: str, profile: Profile) -> CheckName:
    """Name, file and unit of the check of one part on one machine."""
    return f"print {profile.name}", part, UNIT


def _check(one: PrintAssessment, wanted: bool) -> Check:
    name = print_name(one.part, one.profile)
    count = float(len(one.problems))
    detail = "; ".join(one.problems)
    if wanted:
        return at_most(name, count, 0, detail)
    return informative(name, count, detail or _fitting(one))


def _fitting(one: PrintAssessment) -> str:
    return f"fits: {pose_text(one.placing.pose)}, {one.mass_g:.0f} g {one.profile.material}"


def _of_mesh(shape: PartMeasures, profile: Profile) -> Iterator[str]:
    if shape.status != "NoError":
        yield f"no closed solid: manifold3d says {shape.status}"
    if shape.pieces.solids != 1:
        yield f"{shape.pieces.solids} separate solids, 1 wanted"
    if shape.pieces.cavities and not profile.cavities:
        yield f"{shape.pieces.cavities} closed cavities, none wanted"
    if profile.max_triangles is not None and shape.triangles > profile.max_triangles:
        yield f"{shape.triangles} triangles, at most {profile.max_triangles} are read"


def _of_size(shape: PartMeasures, profile: Profile, placing: Placement) -> Iterator[str]:
    walls, holes = shape.walls, shape.holes
    if walls.least < profile.wall_mm - SLACK_MM:
        yield f"least wall {_against(walls.least, profile.wall_mm)}, {_at(walls.where)}"
    narrow = np.flatnonzero(holes.diameter < profile.hole_mm - SLACK_MM)
    if narrow.size:
        k = narrow[holes.diameter[narrow].argmin()]
        hole = _against(float(holes.diameter[k]), profile.hole_mm)
        yield f"smallest hole {hole}, {_at(holes.middle[:, k])}"
    if not placing.fits:
        size, bed = _by(placing.pose.size), _by(profile.bed_mm)
        yield (
            f"{placing.pose.excess:.2f} mm too large: {size} with {pose_text(placing.pose)}, "
            f"the bed is {bed} less {profile.clearance_mm:g} at the rim"
        )


def _against(measured: float, needed: float) -> str:
    return f"{measured:.3g} mm, {needed:g} needed"


def _by(size: Sequence[float] | Floats) -> str:
    return " x ".join(f"{side:.5g}" for side in size)


def _at(point: Floats) -> str:
    return "at ({:.1f}, {:.1f}, {:.1f})".format(*(np.round(point, 1) + 0.0))


def _short(value: float | None) -> float | None:
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}") + 0.0


def _shorts(values: Sequence[float] | None) -> list[float | None] | None:
    return None if values is None else [_short(value) for value in values]
