"""A STEP file compared with the mesh, the record, the closed form, and its own claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.record.export import Camera, Export, Part
from tbcad_verify.record.flange_holes import HoleLimits, flanges, hole_faults
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.record.radius_rule import RULE, rule_check
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    attempt,
    each_at_most,
    guarded,
    require,
    short_list,
)
from tbcad_verify.step.casing import Casing, read_casing, wall
from tbcad_verify.step.part_checks import (
    MASS_CHECKS,
    SOLID_CHECKS,
    Checks,
    PartComparison,
    names_of,
    run_checks,
)
from tbcad_verify.step.pedestal_faces import fronts, wall_errors
from tbcad_verify.step.pedestals import PedestalWalls
from tbcad_verify.step.sphere_union import ClosedFormCells, cells_of_export, walls_of_export
from tbcad_verify.step.step_file import StepFile, known, load
from tbcad_verify.types import Floats, Ints

SURFACE_MM = 1e-8  # the file's digits, 100 mm from the origin
CELL_SHARE = 1e-6  # of a cell's area
MIDDLE_MM = 1e-5
WALL_MM = 1e-3  # the deepest point may lie between corners
HOLE_LIMITS = HoleLimits(size=1e-6, place=1e-3)  # lengths along a section are sums of chords
COVERAGE_MM = 0.1  # spheres fitted to coarse facets, and outlines between their corners
COVERAGE = ("recorded coverage", "mirrors.csv", "mm")
AREAS = ("cell areas", "mirrors.csv", "of the area")


@dataclass(frozen=True, kw_only=True)
class ShellComparison(PartComparison):
    """A shell's STEP file and all that it is compared with.

    Attributes:
        mirrors: the shell's m mirrors, as recorded.
        foreign: ids of all other mirrors.
        coating_mm: that is not part of the solid.
        face: (m,) each mirror's face; -1 where no face, or more than one, has its name.
        cells: (m,) in closed form.
        casing: back and holes.
        wall: thickness behind the deepest valley, mm.
        walls: of pedestals, by the record.
        export: the record.
        camera: that the shell is for.
    """

    mirrors: Mirrors
    foreign: frozenset[str]
    coating_mm: float
    face: Ints
    cells: ClosedFormCells
    casing: Casing
    wall: float | Unknown
    walls: PedestalWalls | None
    export: Export
    camera: Camera


def shell_comparisons(
    export: Export, files: dict[str, StepFile | Unknown]
) -> dict[str, ShellComparison | Unknown]:
    """Each shell's STEP file with all that it is compared with but its mesh, or why not, by part.

    Args:
        export: the record.
        files: as read, by part.
    """
    found = {}
    for part in export.parts:
        if part.step:
            work = partial(_comparison, export, part, files[part.name])
            comparison, reason = attempt(work)
            found[part.name] = comparison or Unknown(reason)
    return found


def shell_step_checks(
    export: Export,
    masses: dict[str, MassProperties],
    comparisons: dict[str, ShellComparison | Unknown],
    coverage: Floats | None = None,
    areas: Sequence[Check] | None = None,
) -> list[Check]:
    """All checks of all STEP files that the record names.

    Args:
        export: the record.
        masses: of the meshes, by part.
        comparisons: by part.
        coverage: (M,) mm, as measured on spheres.
        areas: what `area_checks` gives; None: it is called.
    """

    def of_part(part: Part) -> list[Check]:
        comparison = known(comparisons[part.name])
        return run_checks(chosen, part.step, replace(comparison, mesh_mass=masses.get(part.name)))

    chosen = {**CHECKS, **(WALLS if export.spec.shell.edges == "pedestal" else {})}
    checks = [
        check
        for part in export.parts
        if part.step
        for check in guarded(names_of(chosen, part.step), partial(of_part, part))
    ]
    recorded = [*(area_checks(export) if areas is None else areas)]
    recorded += guarded([RULE], lambda: [rule_check(export)])
    recorded += guarded([COVERAGE], lambda: [_recorded_coverage(export, coverage)])
    return recorded + checks


def area_checks(export: Export) -> list[Check]:
    """The check of the recorded areas, which takes long and needs the record alone."""
    return guarded([AREAS], lambda: [_recorded_areas(export)])


def _recorded_areas(export: Export) -> Check:
    """Areas of the reflecting surfaces as recorded, against the closed form of the spheres."""
    mirrors, area = export.mirrors, np.full(len(export.mirrors), np.nan)
    for camera in export.cameras:
        area[mirrors.camera == camera] = cells_of_export(export, camera, coated=True).area
    error = np.abs(mirrors.cell_area_mm2 / area - 1)
    return _worst_of(AREAS, mirrors.ids, error, CELL_SHARE, "of its area off")


def _recorded_coverage(export: Export, coverage: Floats | None) -> Check:
    """Coverage as recorded, against what rays found."""
    measured = require(coverage, "coverage was not measured")
    error = np.abs(export.mirrors.coverage_mm - measured)
    return _worst_of(COVERAGE, export.mirrors.ids, error, COVERAGE_MM, "mm")


def _comparison(export: Export, part: Part, read: StepFile | Unknown) -> ShellComparison:
    file = known(read)
    mine = export.mirrors.camera == part.camera
    mirrors = export.mirrors.take(np.flatnonzero(mine))
    count = Counter(file.faces.names)
    index = {name: k for k, name in enumerate(file.faces.names)}
    ids, text = frozenset(mirrors.ids), load(export.folder, part.step).text()
    casing = read_casing(text, fronts(file.faces, ids))
    camera = export.cameras[part.camera]
    thickness, no_wall = attempt(lambda: wall(casing, camera, export.semi_minor_mm))
    return ShellComparison(
        part.name,
        file,
        None,
        export.mesh_error_mm,
        mirrors=mirrors,
        foreign=frozenset(export.mirrors.ids) - ids,
        coating_mm=export.coating_mm,
        face=np.array([index[name] if count[name] == 1 else -1 for name in mirrors.ids]),
        cells=cells_of_export(export, part.camera),
        casing=casing,
        wall=Unknown(no_wall) if thickness is None else thickness,
        walls=walls_of_export(export, part.camera),
        export=export,
        camera=camera,
    )


def _names(name: CheckName, shell: ShellComparison) -> Check:
    """Every mirror's name on exactly one face; no name twice, none empty."""
    ids, count = set(shell.mirrors.ids), Counter(shell.file.faces.names)
    faults = [one for one in shell.mirrors.ids if count[one] != 1]
    faults += [
        one or "(empty)" for one, n in count.items() if one not in ids and (n != 1 or not one)
    ]
    faults += [one for one in count if one in shell.foreign]
    detail = f"not on exactly one face, or another part's: {short_list(faults)}"
    return at_most(name, len(faults), 0, detail)


def _surfaces(name: CheckName, shell: ShellComparison) -> Check:
    """Centre and radius of every sphere, position and tilt of every plane, as recorded."""
    faces, mirrors = shell.file.faces, shell.mirrors
    centre, apex, normal = (mirrors.columns(key, 3).T for key in ("cx", "px", "nx"))
    point = _of(shell, faces.point)
    spheres = np.maximum(
        np.linalg.norm(point - centre, axis=1),
        np.abs(_of(shell, faces.radius) - (mirrors.radius_mm - shell.coating_mm)),
    )
    under = apex - shell.coating_mm * normal
    tilt = np.linalg.norm(_of(shell, faces.normal) - normal, axis=1)
    planes = np.maximum(np.abs(((point - under) * normal).sum(axis=1)), tilt)
    error = np.where(mirrors.flat, planes, spheres)
    error[_of(shell, faces.kind) != np.where(mirrors.flat, "plane", "sphere")] = np.inf
    limit = SURFACE_MM * max(1.0, float(np.nanmax(np.abs(centre), initial=0)) / 100)
    return _worst_of(name, mirrors.ids, error, limit, "mm")


def _outward(name: CheckName, shell: ShellComparison) -> Check:
    """Mirrors are convex seen from outside the solid; `_surfaces` tests where planes face."""
    outward = _of(shell, shell.file.faces.outward)
    inward = [shell.mirrors.ids[k] for k in np.flatnonzero(~outward).tolist()]
    detail = f"the solid lies on the wrong side: {short_list(inward)}"
    return at_most(name, len(inward), 0, detail)


def _areas(name: CheckName, shell: ShellComparison) -> Check:
    """Each mirror's area is its cell's, so that no face is the rest of its sphere."""
    error = np.abs(_of(shell, shell.file.faces.area) / shell.cells.area - 1)
    return _worst_of(name, shell.mirrors.ids, error, CELL_SHARE, "of its cell's area off")


def _centroids(name: CheckName, shell: ShellComparison) -> Check:
    centroid = shell.cells.first / shell.cells.area[:, None]
    error = np.linalg.norm(_of(shell, shell.file.faces.middle) - centroid, axis=1)
    return _worst_of(name, shell.mirrors.ids, error, MIDDLE_MM, "mm")


def _front_volume(name: CheckName, shell: ShellComparison) -> Check:
    """Volume between the origin and all mirrors: what the faces enclose against the closed form."""
    faces = shell.file.faces
    area, middle = _of(shell, faces.area), _of(shell, faces.middle)
    centre, radius = _of(shell, faces.point), _of(shell, faces.radius)
    normal = _of(shell, faces.normal)
    # On a sphere x.n = r + C.(x - C)/r; on a plane it is the same everywhere.
    spheres = radius + (centre * (middle - centre)).sum(axis=1) / radius
    height = np.where(shell.mirrors.flat, (middle * normal).sum(axis=1), spheres)
    volume, expected = float((height * area).sum() / 3), float(shell.cells.volume.sum())
    return at_most(
        name,
        abs(volume / expected - 1),
        CELL_SHARE,
        f"{volume:.6f} mm^3 under the mirrors, {expected:.6f} by mirrors.csv alone",
    )


def _walls(name: CheckName, shell: ShellComparison) -> Check:
    """The walls of pedestals, against those that follow from the record."""
    errors = wall_errors(shell.file.faces, shell.mirrors.ids, shell.walls)
    return _worst_of(name, *errors, SURFACE_MM, "mm")


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


def _of(shell: ShellComparison, column: NDArray[Any]) -> NDArray[Any]:
    """(m, ...) the faces' figures in the order of the mirrors; NaN or empty for none."""
    values = column[shell.face].copy()
    missing = shell.face < 0
    values[missing] = np.nan if values.dtype.kind == "f" else np.zeros((), dtype=values.dtype)
    return values


def _worst_of(name: CheckName, ids: Sequence[str], error: Floats, limit: float, unit: str) -> Check:
    """The worst mirror; one without a face counts as infinitely wrong."""
    error = np.where(np.isnan(error), np.inf, error)
    return each_at_most(name, ids, error, limit, unit)


WALLS: Checks = {"step walls": ("mm", _walls)}
CHECKS: Checks = {
    **SOLID_CHECKS,
    "step names": ("missing or extra", _names),
    "step surfaces": ("mm", _surfaces),
    "step outward": ("turned faces", _outward),
    "step cells": ("of the area", _areas),
    "step cell centroids": ("mm", _centroids),
    "step front volume": ("of the volume", _front_volume),
    "step wall": ("mm", _wall),
    "step holes": ("faults", _holes),
    **MASS_CHECKS,
}
