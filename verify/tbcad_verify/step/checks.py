"""A STEP file held against the mesh, the record, the closed form, and its own claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.bulk import Bulk
from tbcad_verify.checks import Check, Name, Unknown, at_most, guarded, listed, offenders
from tbcad_verify.files import Blob
from tbcad_verify.rays import in_threads
from tbcad_verify.record import Export, Part
from tbcad_verify.step.reading import StepFile, examine, load
from tbcad_verify.step.union import Cells, of_export

Floats = NDArray[np.float64]

SURFACE_MM = 1e-8  # the file's digits, 100 mm from the origin
GAP_MM = 1e-5  # a hundred times the kernel's own precision
CELL_SHARE = 1e-6  # of a cell's area
MIDDLE_MM = 1e-5
CLAIM_SHARE = 1e-6  # of what the file claims
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
class Subject:
    """One part's STEP file and all that it is held against.

    Attributes:
        name: of the part.
        file: as read.
        row: (m,) numbers of the part's mirrors in the record.
        face: (m,) each mirror's face; -1 where no face, or more than one, has its name.
        cells: (m,) in closed form.
        bulk: the mesh's; None where it could not be measured.
        off: how far the mesh may be from the exact surface, mm.
    """

    name: str
    file: StepFile
    row: NDArray[np.intp]
    face: NDArray[np.intp]
    cells: Cells
    bulk: Bulk | None
    off: float


Job = Callable[[Name, Subject, Export], Check]


def step_checks(export: Export, bulks: dict[str, Bulk], seconds: float) -> list[Check]:
    """All checks of all STEP files that the record names.

    Args:
        export: the record.
        bulks: figures of the meshes, by part.
        seconds: longest that reading one file may take.

    Raises:
        BadExport: a file is missing, foreign or truncated.
    """
    parts = [part for part in export.parts if part.step]
    blobs = [load(export.folder, part.step) for part in parts]
    found = in_threads(
        lambda pair: _part(export, *pair, bulks, seconds), list(zip(parts, blobs, strict=True))
    )
    areas = guarded([AREAS], lambda: [_recorded(export)])
    return areas + [check for checks in found for check in checks]


def _recorded(export: Export) -> Check:
    """Areas of the reflecting surfaces as recorded, against what the spheres alone make them."""
    found = np.full(len(export.rows), np.nan)
    for camera in export.cameras:
        found[export.rows.camera == camera] = of_export(export, camera, coated=True).area
    error = np.abs(export.rows.columns("cell_area_mm2")[0] / found - 1)
    return _worst_of(AREAS, export.rows.ids, error, CELL_SHARE, "of its area away", ".3g")


def _part(
    export: Export, part: Part, blob: Blob, bulks: dict[str, Bulk], seconds: float
) -> list[Check]:
    names = [(name, part.step, unit) for name, unit in UNITS.items()]

    def work() -> list[Check]:
        subject = _subject(export, part, examine(blob, seconds), bulks.get(part.name))
        return [
            check
            for name, job in zip(names, JOBS, strict=True)
            for check in guarded([name], partial(_one, job, name, subject, export))
        ]

    return guarded(names, work)


def _one(job: Job, name: Name, subject: Subject, export: Export) -> list[Check]:
    return [job(name, subject, export)]


def _subject(export: Export, part: Part, file: StepFile, bulk: Bulk | None) -> Subject:
    row = np.flatnonzero(export.rows.camera == part.camera)
    ids = [export.rows.ids[k] for k in row.tolist()]
    count = Counter(file.faces.names)
    place = {name: k for k, name in enumerate(file.faces.names)}
    face = np.array([place[name] if count[name] == 1 else -1 for name in ids], dtype=np.intp)
    return Subject(
        part.name, file, row, face, of_export(export, part.camera), bulk, export.mesh_error_mm
    )


def _solid(name: Name, subject: Subject, _: Export) -> Check:
    counts, named = subject.file.counts, subject.file.solids
    faults = abs(counts["solids"] - 1) + abs(counts["shells"] - 1) + counts["open_edges"]
    said = ", ".join(f"{count} {what.replace('_', ' ')}" for what, count in counts.items())
    odd = int(named != (subject.name,))
    return at_most(name, faults + odd, 0, f"{said}; named {listed(named)}, not {subject.name}")


def _valid(name: Name, subject: Subject, _: Export) -> Check:
    return at_most(name, int(not subject.file.valid), 0, "the kernel's check refuses the shape")


def _gaps(name: Name, subject: Subject, _: Export) -> Check:
    """Corners lie on their edges and edges on their faces, before a reader widens them."""
    return at_most(name, subject.file.gap, GAP_MM, "corners, edges and faces do not meet")


def _names(name: Name, subject: Subject, export: Export) -> Check:
    """Every mirror's name on exactly one face; no name twice, none empty."""
    ids = [export.rows.ids[k] for k in subject.row.tolist()]
    count = Counter(subject.file.faces.names)
    lost = [one for one in ids if count[one] != 1]
    odd = [one or "(empty)" for one, times in count.items() if times != 1 or not one]
    others = {one for one in export.rows.ids if one not in set(ids)}
    foreign = [one for one in count if one in others]
    odd = [*lost, *(one for one in odd if one not in lost), *foreign]
    return at_most(name, len(odd), 0, f"not on exactly one face, or another part's: {listed(odd)}")


def _surfaces(name: Name, subject: Subject, export: Export) -> Check:
    """Centre and radius of every sphere, place and tilt of every plane, as recorded."""
    faces, mirrors = subject.file.faces, export.rows.take(subject.row)
    centre, radius = mirrors.columns("cx", 3).T, mirrors.columns("radius_mm")[0]
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


def _outward(name: Name, subject: Subject, export: Export) -> Check:
    """Mirrors bulge out of the solid; where planes face is for `_surfaces`."""
    mirrors = export.rows.take(subject.row)
    good = _of(subject, subject.file.faces.outward)
    turned = [mirrors.ids[k] for k in np.flatnonzero(~good).tolist()]
    return at_most(name, len(turned), 0, f"the solid lies on the wrong side: {listed(turned)}")


def _areas(name: Name, subject: Subject, export: Export) -> Check:
    """Each mirror's area is its cell's, so that no face is the rest of its sphere."""
    error = np.abs(_of(subject, subject.file.faces.area) / subject.cells.area - 1)
    return _worst(name, subject, export, error, CELL_SHARE, "of its cell's area away", ".3g")


def _middles(name: Name, subject: Subject, export: Export) -> Check:
    wanted = subject.cells.first / subject.cells.area[:, None]
    away = _of(subject, subject.file.faces.middle) - wanted
    error = np.linalg.norm(away, axis=1)
    return _worst(name, subject, export, error, MIDDLE_MM, "mm", ".3g")


def _front(name: Name, subject: Subject, export: Export) -> Check:
    """Volume between the origin and all mirrors: what the faces enclose against the closed form."""
    faces, mirrors = subject.file.faces, export.rows.take(subject.row)
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


def _volume(name: Name, subject: Subject, _: Export) -> Check:
    mesh, solid = _bulks(subject)
    return at_most(
        name,
        abs(mesh.volume - solid.volume),
        solid.area * subject.off,
        f"STEP {solid.volume:.3f}, mesh {mesh.volume:.3f}",
    )


def _area(name: Name, subject: Subject, _: Export) -> Check:
    """Facets off by h from a surface of radius r lose some 2 h / r of its area."""
    mesh, solid = _bulks(subject)
    radius = subject.file.faces.radius
    least = np.nanmin(radius, initial=np.ptp([solid.low, solid.high], axis=0).max() / 2)
    limit = solid.area * 2 * subject.off / float(least)
    detail = f"STEP {solid.area:.3f}, mesh {mesh.area:.3f}"
    return at_most(name, abs(mesh.area - solid.area), limit, detail)


def _centroid(name: Name, subject: Subject, _: Export) -> Check:
    """A layer of the mesh's error all on one side moves the middle by its share of the volume."""
    mesh, solid = _bulks(subject)
    wide = float(np.linalg.norm(np.subtract(solid.high, solid.low))) / 2
    away = float(np.linalg.norm(np.subtract(mesh.centroid, solid.centroid)))
    detail = f"STEP {_three(solid.centroid)}, mesh {_three(mesh.centroid)}"
    return at_most(name, away, wide * solid.area * subject.off / solid.volume, detail)


def _box(name: Name, subject: Subject, _: Export) -> Check:
    mesh, solid = _bulks(subject)
    away = np.abs(np.subtract([mesh.low, mesh.high], [solid.low, solid.high])).max()
    detail = (
        f"STEP {_three(solid.low)} to {_three(solid.high)}, "
        f"mesh {_three(mesh.low)} to {_three(mesh.high)}"
    )
    return at_most(name, float(away), subject.off, detail)


def _properties(name: Name, subject: Subject, _: Export) -> Check:
    """The file's own claims, so that any reader can tell whether it has read what was written."""
    claims, solid = subject.file.properties, subject.file.bulk
    if set(claims) != {"volume", "area", "centroid"}:
        detail = f"the file claims {listed(sorted(claims)) or 'nothing'}; all three are wanted"
        return at_most(name, np.inf, CLAIM_SHARE, detail)
    wide = float(np.linalg.norm(np.subtract(solid.high, solid.low)))
    shares = (
        abs(claims["volume"] / solid.volume - 1),
        abs(claims["area"] / solid.area - 1),
        float(np.linalg.norm(np.subtract(claims["centroid"], solid.centroid))) / wide,
    )
    detail = f"volume, area, centroid off by {', '.join(f'{share:.3g}' for share in shares)}"
    return at_most(name, max(shares), CLAIM_SHARE, detail)


def _bulks(subject: Subject) -> tuple[Bulk, Bulk]:
    if subject.bulk is None:
        raise Unknown("the mesh could not be measured")
    return subject.bulk, subject.file.bulk


def _of(subject: Subject, column: NDArray[Any]) -> NDArray[Any]:
    """(m, ...) the faces' figures in the order of the mirrors; NaN or empty for none."""
    taken = column[subject.face].copy()
    lost = subject.face < 0
    taken[lost] = np.nan if taken.dtype.kind == "f" else np.zeros((), dtype=taken.dtype)
    return taken


def _worst(
    name: Name, subject: Subject, export: Export, error: Floats, limit: float, unit: str, form: str
) -> Check:
    """The worst mirror; one without a face counts as infinitely wrong."""
    ids = [export.rows.ids[k] for k in subject.row.tolist()]
    return _worst_of(name, ids, error, limit, unit, form)


def _worst_of(
    name: Name, ids: Sequence[str], error: Floats, limit: float, unit: str, form: str
) -> Check:
    error = np.where(np.isnan(error), np.inf, error)
    order = np.argsort(-error, kind="stable")
    order = order[error[order] > limit]
    return at_most(
        name, float(error.max(initial=0)), limit, offenders(ids, error, unit, order, form)
    )


JOBS: tuple[Job, ...] = (
    *(_solid, _valid, _gaps, _names, _surfaces, _outward, _areas, _middles, _front),
    *(_volume, _area, _centroid, _box, _properties),
)


def _three(point: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in point) + ")"
