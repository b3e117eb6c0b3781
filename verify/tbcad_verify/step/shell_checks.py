"""STEP files of shells and of their negatives: mirrors, what closes the solid, mass and claims.

A negative has the shell's mirrors with the material on their other side.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.record.export import Export, Mandrel, Part
from tbcad_verify.record.flange_holes import (
    HoleLimits,
    X,
    Z,
    blind_hole_faults,
    flanges,
    hole_faults,
)
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    attempt,
    no_faults,
    require,
    short_list,
)
from tbcad_verify.step import front_checks
from tbcad_verify.step.front_checks import CELL_SHARE, WALLS, FrontComparison, compare
from tbcad_verify.step.part_checks import MASS_CHECKS, SOLID_CHECKS, Checks, file_checks
from tbcad_verify.step.solids_text import Casing, wall
from tbcad_verify.step.step_file import StepFile, known

WALL_MM = 1e-3  # the deepest point may lie between corners
HOLE_LIMITS = HoleLimits(size=1e-6, place=1e-3)  # lengths along a section are sums of chords
PLANE_MM = 1e-8  # of a negative's joining planes and the bottoms of holes
BLIND_LIMITS = HoleLimits(size=1e-6, place=1e-6)
Comparisons = Mapping[str, FrontComparison | Unknown]


def compare_all(export: Export, files: Mapping[str, StepFile | Unknown]) -> Comparisons:
    """The STEP files of all shells and negatives as `compare` has them, or why not, by part."""
    found: dict[str, FrontComparison | Unknown] = {}
    for part in (*export.parts, *export.mandrels):
        if part.step:
            comparison, reason = attempt(partial(compare, export, part, files[part.name]))
            found[part.name] = comparison or Unknown(reason)
    return found


def front_step_checks(
    export: Export,
    parts: Sequence[Part],
    masses: Mapping[str, MassProperties],
    comparisons: Comparisons,
) -> list[Check]:
    """The checks of each part with a STEP file, with its mesh; unknown where they break."""
    walls = WALLS if export.spec.shell.edges == "pedestal" else {}

    def compared(part: Part) -> FrontComparison:
        return replace(known(comparisons[part.name]), mesh_mass=masses.get(part.name))

    return [
        check
        for part in parts
        if part.step
        for check in file_checks(
            {**(NEGATIVE if isinstance(part, Mandrel) else SHELL), **walls},
            part.step,
            partial(compared, part),
        )
    ]


def _wall(name: CheckName, shell: FrontComparison) -> Check:
    """Material behind the deepest valley, as the spec has it."""
    asked, export = shell.export.spec.shell.wall_mm, shell.export
    measured = wall(_casing(shell), shell.camera, export.semi_minor_mm)
    detail = f"the wall is {measured:.3f} mm, the spec has {asked:g}"
    return at_most(name, abs(measured - asked), WALL_MM, detail)


def _holes(name: CheckName, shell: FrontComparison) -> Check:
    """Bolt and dowel holes, as the spec has them."""
    beyond = _casing(shell).semi_axes[1] - shell.export.semi_minor_mm
    wanted = flanges(shell.export, shell.camera, beyond)
    return no_faults(name, hole_faults(shell.holes, wanted, HOLE_LIMITS))


def _casing(shell: FrontComparison) -> Casing:
    return require(shell.casing, "it is no shell")


def _planes(name: CheckName, part: FrontComparison) -> Check:
    """The seam is x = 0, the foot is z = foot, and all other planes are bottoms of holes."""
    faces, side = part.file.faces, float(np.sign(part.camera.pinhole[X]))
    wanted = {"seam": (X, 0.0, -side), "foot": (Z, part.export.foot_z_mm, -1.0)}
    faults = [one for one in wanted if one not in faces.names]
    for k, one in enumerate(faces.names):
        plane = one.partition("_")[0]
        if one in part.fronts or (one not in wanted and faces.kind[k] == "other"):
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


def _blind_holes(name: CheckName, part: FrontComparison) -> Check:
    """Sizes and numbers of the flanges' holes, and walls to all mirrors."""
    faults = blind_hole_faults(part.holes, part.export, part.part.camera, BLIND_LIMITS)
    return no_faults(name, faults)


def _enclosed(name: CheckName, part: FrontComparison) -> Check:
    """The solid's volume, against the closed form of the mirrors and a foot without its holes.

    Cones from the origin to mirrors, walls of pedestals and foot fill the negative; the plane of
    the seam holds the origin.
    """
    faces = part.file.faces
    bores = np.array([np.pi * hole.radius**2 for hole in part.holes])
    along_z = np.array([abs(hole.axis[Z]) > abs(hole.axis[X]) for hole in part.holes])
    depth = np.array([hole.depth for hole in part.holes])
    base = float(faces.area[faces.names.index("foot")]) + float(bores[along_z].sum())
    ids = part.fronts.difference(part.mirrors.ids)
    walls = [k for k, one in enumerate(faces.names) if one in ids]
    height = (faces.middle[walls] * faces.normal[walls]).sum(axis=1)
    expected = -float(part.cells.volume.sum()) - part.export.foot_z_mm * base / 3
    expected += float((height * faces.area[walls]).sum() / 3) - float(bores @ depth)
    volume = part.file.mass.volume
    detail = f"{volume:.6f} mm^3, {expected:.6f} by mirrors, foot and holes"
    return at_most(name, abs(volume / expected - 1), CELL_SHARE, detail)


SHELL: Checks = {
    **SOLID_CHECKS,
    **front_checks.CHECKS,
    "step wall": ("mm", _wall),
    "step holes": ("faults", _holes),
    **MASS_CHECKS,
}
NEGATIVE: Checks = {
    **SOLID_CHECKS,
    **front_checks.CHECKS,
    "step mandrel planes": ("faults", _planes),
    "step mandrel holes": ("faults", _blind_holes),
    "step mandrel volume": ("of the volume", _enclosed),
    **MASS_CHECKS,
}
