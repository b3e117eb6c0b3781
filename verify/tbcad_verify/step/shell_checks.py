"""A STEP file held against the mesh, the record, the closed form, and its own claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.record.export import Export, Part
from tbcad_verify.record.files import FileBytes
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_most,
    guarded,
    short_list,
    worst_offenders,
)
from tbcad_verify.step import part_checks
from tbcad_verify.step.part_checks import PartComparison
from tbcad_verify.step.sphere_union import ClosedFormCells, cells_of_export
from tbcad_verify.step.step_file import StepFile, examine, load
from tbcad_verify.types import Floats

SURFACE_MM = 1e-8  # the file's digits, 100 mm from the origin
CELL_SHARE = 1e-6  # of a cell's area
MIDDLE_MM = 1e-5
AREAS = ("cell areas", "mirrors.csv", "of the area")
UNITS = {
    "step solid": "faults",
    "step valid": "complaints",
    "step gaps": "mm",
    "step names": "missing or extra",
    "step surfaces": "mm",
    "step outward": "turned faces",
    "step cells": "of the area",
    "step middles": "mm",
    "step front": "of the volume",
    "step volume": "mm^3",
    "step area": "mm^2",
    "step centroid": "mm",
    "step box": "mm",
    "step properties": "of the figure",
}


@dataclass(frozen=True)
class ShellComparison:
    """One part's STEP file and all that it is held against.

    Attributes:
        lump: the file, and the mesh that it is held against.
        row: (m,) numbers of the part's mirrors in the record.
        face: (m,) each mirror's face; -1 where no face, or more than one, has its name.
        cells: (m,) in closed form.
    """

    lump: PartComparison
    row: NDArray[np.intp]
    face: NDArray[np.intp]
    cells: ClosedFormCells

    @property
    def file(self) -> StepFile:
        """The file as read."""
        return self.lump.file


Job = Callable[[CheckName, ShellComparison, Export], Check]


def shell_step_checks(
    export: Export, masses: dict[str, MassProperties], seconds: float
) -> list[Check]:
    """All checks of all STEP files that the record names.

    Args:
        export: the record.
        masses: figures of the meshes, by part.
        seconds: longest that reading one file may take.

    Raises:
        BadExport: a file is missing, foreign or truncated.
    """
    parts = [part for part in export.parts if part.step]
    blobs = [load(export.folder, part.step) for part in parts]
    found = in_threads(
        lambda pair: _part(export, *pair, masses, seconds), list(zip(parts, blobs, strict=True))
    )
    areas = guarded([AREAS], lambda: [_recorded(export)])
    return areas + [check for checks in found for check in checks]


def _recorded(export: Export) -> Check:
    """Areas of the reflecting surfaces as recorded, against what the spheres alone make them."""
    found = np.full(len(export.mirrors), np.nan)
    for camera in export.cameras:
        found[export.mirrors.camera == camera] = cells_of_export(export, camera, coated=True).area
    error = np.abs(export.mirrors.cell_area_mm2 / found - 1)
    return _worst_of(AREAS, export.mirrors.ids, error, CELL_SHARE, "of its area away", ".3g")


def _part(
    export: Export, part: Part, blob: FileBytes, masses: dict[str, MassProperties], seconds: float
) -> list[Check]:
    names = [(name, part.step, unit) for name, unit in UNITS.items()]

    def work() -> list[Check]:
        subject = _subject(export, part, examine(blob, seconds), masses.get(part.name))
        return [
            check
            for name, job in zip(names, JOBS, strict=True)
            for check in guarded([name], partial(_one, job, name, subject, export))
        ]

    return guarded(names, work)


def _one(job: Job, name: CheckName, subject: ShellComparison, export: Export) -> list[Check]:
    return [job(name, subject, export)]


def _subject(
    export: Export, part: Part, file: StepFile, mass: MassProperties | None
) -> ShellComparison:
    row = np.flatnonzero(export.mirrors.camera == part.camera)
    ids = [export.mirrors.ids[k] for k in row.tolist()]
    count = Counter(file.faces.names)
    place = {name: k for k, name in enumerate(file.faces.names)}
    face = np.array([place[name] if count[name] == 1 else -1 for name in ids], dtype=np.intp)
    lump = PartComparison(part.name, file, mass, export.mesh_error_mm)
    return ShellComparison(lump, row, face, cells_of_export(export, part.camera))


def _names(name: CheckName, subject: ShellComparison, export: Export) -> Check:
    """Every mirror's name on exactly one face; no name twice, none empty."""
    ids = [export.mirrors.ids[k] for k in subject.row.tolist()]
    count = Counter(subject.file.faces.names)
    lost = [one for one in ids if count[one] != 1]
    odd = [one or "(empty)" for one, times in count.items() if times != 1 or not one]
    others = {one for one in export.mirrors.ids if one not in set(ids)}
    foreign = [one for one in count if one in others]
    odd = [*lost, *(one for one in odd if one not in lost), *foreign]
    return at_most(
        name, len(odd), 0, f"not on exactly one face, or another part's: {short_list(odd)}"
    )


def _surfaces(name: CheckName, subject: ShellComparison, export: Export) -> Check:
    """Centre and radius of every sphere, place and tilt of every plane, as recorded."""
    faces, mirrors = subject.file.faces, export.mirrors.take(subject.row)
    centre, radius = mirrors.columns("cx", 3).T, mirrors.radius_mm
    apex, normal = mirrors.columns("px", 3).T, mirrors.columns("nx", 3).T
    point = _of(subject, faces.point)
    spheres = np.maximum(
        np.linalg.norm(point - centre, axis=1),
        np.abs(_of(subject, faces.radius) - (radius - export.coating_mm)),
    )
    under = apex - export.coating_mm * normal
    tilt = np.linalg.norm(_of(subject, faces.normal) - normal, axis=1)
    planes = np.maximum(np.abs(((point - under) * normal).sum(axis=1)), tilt)
    wanted = np.where(mirrors.flat, "plane", "sphere")
    error = np.where(mirrors.flat, planes, spheres)
    error[_of(subject, faces.kind) != wanted] = np.inf
    limit = SURFACE_MM * max(1.0, float(np.nanmax(np.abs(centre), initial=0)) / 100)
    return _worst(name, subject, export, error, limit, "mm", ".3g")


def _outward(name: CheckName, subject: ShellComparison, export: Export) -> Check:
    """Mirrors bulge out of the solid; where planes face is for `_surfaces`."""
    mirrors = export.mirrors.take(subject.row)
    good = _of(subject, subject.file.faces.outward)
    turned = [mirrors.ids[k] for k in np.flatnonzero(~good).tolist()]
    return at_most(name, len(turned), 0, f"the solid lies on the wrong side: {short_list(turned)}")


def _areas(name: CheckName, subject: ShellComparison, export: Export) -> Check:
    """Each mirror's area is its cell's, so that no face is the rest of its sphere."""
    error = np.abs(_of(subject, subject.file.faces.area) / subject.cells.area - 1)
    return _worst(name, subject, export, error, CELL_SHARE, "of its cell's area away", ".3g")


def _middles(name: CheckName, subject: ShellComparison, export: Export) -> Check:
    wanted = subject.cells.first / subject.cells.area[:, None]
    away = _of(subject, subject.file.faces.middle) - wanted
    error = np.linalg.norm(away, axis=1)
    return _worst(name, subject, export, error, MIDDLE_MM, "mm", ".3g")


def _front(name: CheckName, subject: ShellComparison, export: Export) -> Check:
    """Volume between the origin and all mirrors: what the faces enclose against the closed form."""
    faces, mirrors = subject.file.faces, export.mirrors.take(subject.row)
    area, middle = _of(subject, faces.area), _of(subject, faces.middle)
    centre, radius = _of(subject, faces.point), _of(subject, faces.radius)
    normal = _of(subject, faces.normal)
    # On a sphere x.n = r + C.(x - C)/r; on a plane it is the same everywhere.
    spheres = radius + (centre * (middle - centre)).sum(axis=1) / radius
    height = np.where(mirrors.flat, (middle * normal).sum(axis=1), spheres)
    found, wanted = float((height * area).sum() / 3), float(subject.cells.volume.sum())
    return at_most(
        name,
        abs(found / wanted - 1),
        CELL_SHARE,
        f"{found:.6f} mm^3 under the mirrors, {wanted:.6f} by mirrors.csv alone",
    )


def _of(subject: ShellComparison, column: NDArray[Any]) -> NDArray[Any]:
    """(m, ...) the faces' figures in the order of the mirrors; NaN or empty for none."""
    taken = column[subject.face].copy()
    lost = subject.face < 0
    taken[lost] = np.nan if taken.dtype.kind == "f" else np.zeros((), dtype=taken.dtype)
    return taken


def _worst(
    name: CheckName,
    subject: ShellComparison,
    export: Export,
    error: Floats,
    limit: float,
    unit: str,
    form: str,
) -> Check:
    """The worst mirror; one without a face counts as infinitely wrong."""
    ids = [export.mirrors.ids[k] for k in subject.row.tolist()]
    return _worst_of(name, ids, error, limit, unit, form)


def _worst_of(
    name: CheckName, ids: Sequence[str], error: Floats, limit: float, unit: str, form: str
) -> Check:
    error = np.where(np.isnan(error), np.inf, error)
    order = np.argsort(-error, kind="stable")
    order = order[error[order] > limit]
    return at_most(
        name, float(error.max(initial=0)), limit, worst_offenders(ids, error, unit, order, form)
    )


def _plain(job: part_checks.Job) -> Job:
    """A check of any part, for one with mirrors."""
    return lambda name, subject, _: job(name, subject.lump)


JOBS: tuple[Job, ...] = (
    *map(_plain, (part_checks.solid, part_checks.valid, part_checks.gaps)),
    *(_names, _surfaces, _outward, _areas, _middles, _front),
    *map(
        _plain,
        (
            part_checks.volume,
            part_checks.area,
            part_checks.centroid,
            part_checks.box,
            part_checks.properties,
        ),
    ),
)
