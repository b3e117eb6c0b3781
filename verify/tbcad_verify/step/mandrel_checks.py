"""The STEP file of a negative: the shell's mirrors with the material on their other side."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.record.export import Export, Mandrel
from tbcad_verify.record.flange_holes import Hole, HoleLimits, X, Z, blind_hole_faults
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    short_list,
)
from tbcad_verify.step.front_checks import (
    CELL_SHARE,
    FrontComparison,
    each_checked,
    each_compared,
    front_fields,
)
from tbcad_verify.step.front_checks import CHECKS as FRONT_CHECKS
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.part_checks import (
    MASS_CHECKS,
    SOLID_CHECKS,
    Checks,
)
from tbcad_verify.step.pedestals import fronts
from tbcad_verify.step.solids_text import bores
from tbcad_verify.step.step_file import StepFaces, StepFile, known, load

PLANE_MM = 1e-8  # of the joining planes and the bottoms of holes
HOLE_LIMITS = HoleLimits(size=1e-6, place=1e-6)
PLANES = ("seam", "foot")


@dataclass(frozen=True, kw_only=True)
class MandrelComparison(FrontComparison):
    """A negative's STEP file and all that it is compared with."""

    holes: tuple[Hole, ...]  # blind ones


def mandrel_comparisons(
    export: Export, files: dict[str, StepFile | Unknown]
) -> dict[str, MandrelComparison | Unknown]:
    """Each negative's STEP file with all that it is compared with but its mesh, or why not."""
    return each_compared(export.mandrels, files, partial(_comparison, export))


def mandrel_step_checks(
    export: Export,
    masses: dict[str, MassProperties],
    comparisons: dict[str, MandrelComparison | Unknown],
) -> list[Check]:
    """All checks of the negatives' STEP files."""
    return each_checked(export, export.mandrels, CHECKS, masses, comparisons)


def _comparison(export: Export, part: Mandrel, read: StepFile | Unknown) -> MandrelComparison:
    file, table = known(read), StepTable(load(export.folder, part.step).text())
    faces = file.faces
    outward = np.where(faces.kind == "sphere", faces.inward, faces.outward)
    turned = replace(faces, normal=-faces.normal, outward=outward)
    fields = front_fields(export, part, file, table, turned)
    names = fronts(faces.names, frozenset(fields["mirrors"].ids))
    return MandrelComparison(**fields, holes=bores(table, names))


def _planes(name: CheckName, part: MandrelComparison) -> Check:
    """The seam is x = 0, the foot is z = foot, and all other planes are bottoms of holes."""
    faces, side = part.file.faces, float(np.sign(part.camera.pinhole[X]))
    wanted = {"seam": (X, 0.0, -side), "foot": (Z, part.export.foot_z_mm, -1.0)}
    front = fronts(faces.names, frozenset(part.mirrors.ids))
    faults = [one for one in PLANES if one not in faces.names]
    for k, one in enumerate(faces.names):
        plane = one.partition("_")[0]
        if one in front or (one not in wanted and faces.kind[k] == "other"):
            continue
        if plane not in wanted or faces.kind[k] != "plane":
            faults.append(one)
            continue
        axis, place, outward = wanted[plane]
        square = abs(faces.normal[k, axis] - outward) <= PLANE_MM
        depths = [0.0] if one == plane else [hole.depth for hole in part.holes]
        off = min(abs(faces.point[k, axis] - place + outward * depth) for depth in depths)
        if not (square and off <= PLANE_MM and faces.outward[k]):
            faults.append(one)
    return at_most(name, len(faults), 0, f"not in their planes: {short_list(faults)}")


def _holes(name: CheckName, part: MandrelComparison) -> Check:
    """Sizes and numbers of the flanges' holes, and walls to all mirrors."""
    faults = blind_hole_faults(part.holes, part.export, part.camera.id, HOLE_LIMITS)
    return at_most(name, len(faults), 0, short_list(faults))


def _enclosed(name: CheckName, part: MandrelComparison) -> Check:
    """The solid's volume, against the closed form of the mirrors and a foot without its holes.

    Cones from the origin to mirrors and foot fill the negative; the plane of the seam holds it.
    """
    faces, foot = part.file.faces, part.export.foot_z_mm
    bores = np.array([np.pi * hole.radius**2 for hole in part.holes])
    along_z = np.array([abs(hole.axis[Z]) > abs(hole.axis[X]) for hole in part.holes])
    depth = np.array([hole.depth for hole in part.holes])
    base = float(faces.area[faces.names.index("foot")]) + float(bores[along_z].sum())
    expected = -float(part.cells.volume.sum()) - foot * base / 3 + _wall_volume(part, faces)
    expected -= float(bores @ depth)
    volume = part.file.mass.volume
    return at_most(
        name,
        abs(volume / expected - 1),
        CELL_SHARE,
        f"{volume:.6f} mm^3, {expected:.6f} by mirrors, foot and holes",
    )


def _wall_volume(part: MandrelComparison, faces: StepFaces) -> float:
    """Between the origin and the walls of pedestals, mm^3."""
    ids = frozenset(part.mirrors.ids)
    walls = fronts(faces.names, ids) - ids
    at = [k for k, one in enumerate(faces.names) if one in walls]
    height = (faces.middle[at] * faces.normal[at]).sum(axis=1)
    return float((height * faces.area[at]).sum() / 3)


CHECKS: Checks = {
    **SOLID_CHECKS,
    **FRONT_CHECKS,
    "step mandrel planes": ("faults", _planes),
    "step mandrel holes": ("faults", _holes),
    "step mandrel volume": ("of the volume", _enclosed),
    **MASS_CHECKS,
}
