"""The mirrors' faces of a STEP file against the record and the closed form."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.record.export import Camera, Export, Mandrel, Part
from tbcad_verify.record.flange_holes import Hole, ends_check
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    each_at_most,
    require,
    short_list,
)
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.part_checks import Checks, PartComparison
from tbcad_verify.step.pedestals import Grooves, fronts, read_grooves, wall_errors
from tbcad_verify.step.solids_text import Casing, bores, read_casing
from tbcad_verify.step.sphere_union import ClosedFormCells, bounds, cells_of_export
from tbcad_verify.step.step_file import StepFaces, StepFile, known, load
from tbcad_verify.types import Floats, Ints

SURFACE_MM = 1e-8  # the file's digits, 100 mm from the origin
CELL_SHARE = 1e-6  # of a cell's area
MIDDLE_MM = 1e-5
ENDS_MM = 1e-6  # ten times the precision to which the kernel joins corners and planes


@dataclass(frozen=True, kw_only=True)
class FrontComparison(PartComparison):
    """The mirrors of a STEP file and all that they are compared with, and what closes the solid."""

    export: Export  # the record
    part: Part  # its record
    mirrors: Mirrors  # the camera's m mirrors, as recorded
    face: Ints  # (m,) each mirror's face; -1 where no face, or more than one, has its name
    front: StepFaces  # the file's faces as seen from the light
    fronts: frozenset[str]  # names of the faces that are mirrors, or walls below them
    cells: ClosedFormCells  # (m,) in closed form
    grooves: Grooves | None  # between pedestals, in the file
    holes: tuple[Hole, ...]  # round, by diameter; those of a negative are blind
    casing: Casing | None  # of a shell: its back

    @property
    def camera(self) -> Camera:
        """That the part is for."""
        return self.export.cameras[self.part.camera]


def compare(export: Export, part: Part, read: StepFile | Unknown) -> FrontComparison:
    """The STEP file of a shell or a negative with all that it is compared with but its mesh.

    Unknown: it could not be read, or lacks the walls of pedestals or the back that it must have.
    """
    file, table = known(read), StepTable(load(export.folder, part.step).text())
    names, negative = file.faces.names, isinstance(part, Mandrel)
    front = _turned(file.faces) if negative else file.faces
    mirrors = export.mirrors.take(np.flatnonzero(export.mirrors.camera == part.camera))
    count, index = Counter(names), {name: k for k, name in enumerate(names)}
    pedestals = export.spec.shell.edges == "pedestal"
    grooves = read_grooves(table, front, mirrors.ids) if pedestals else None
    mine = fronts(names, frozenset(mirrors.ids))
    return FrontComparison(
        name=part.name,
        file=file,
        mesh_mass=None,
        mesh_error=export.mesh_error_mm,
        export=export,
        part=part,
        mirrors=mirrors,
        face=np.array([index[name] if count[name] == 1 else -1 for name in mirrors.ids]),
        front=front,
        fronts=mine,
        cells=cells_of_export(export, part.camera, grooves),
        grooves=grooves,
        holes=bores(table, mine),
        casing=None if negative else read_casing(table, mine),
    )


def _turned(faces: StepFaces) -> StepFaces:
    """The faces of a negative as those of the shell, on the other side of its mirrors."""
    outward = np.where(faces.kind == "sphere", faces.inward, faces.outward)
    return replace(faces, normal=-faces.normal, outward=outward)


def names(name: CheckName, part: FrontComparison) -> Check:
    """Every mirror's name on exactly one face; no name twice, none empty."""
    ids, count = set(part.mirrors.ids), Counter(part.file.faces.names)
    foreign = set(part.export.mirrors.ids) - ids
    faults = [one for one in part.mirrors.ids if count[one] != 1]
    faults += [
        one or "(empty)" for one, n in count.items() if one not in ids and (n != 1 or not one)
    ]
    faults += [one for one in count if one in foreign]
    detail = f"not on exactly one face, or another part's: {short_list(faults)}"
    return at_most(name, len(faults), 0, detail)


def surfaces(name: CheckName, part: FrontComparison) -> Check:
    """Centre and radius of every sphere, position and tilt of every plane, as recorded."""
    faces, mirrors = part.front, part.mirrors
    centre, apex, normal = (mirrors.columns(key, 3).T for key in ("cx", "px", "nx"))
    point = _of(part, faces.point)
    spheres = np.maximum(
        np.linalg.norm(point - centre, axis=1),
        np.abs(_of(part, faces.radius) - (mirrors.radius_mm - part.export.coating_mm)),
    )
    under = apex - part.export.coating_mm * normal
    tilt = np.linalg.norm(_of(part, faces.normal) - normal, axis=1)
    planes = np.maximum(np.abs(((point - under) * normal).sum(axis=1)), tilt)
    error = np.where(mirrors.flat, planes, spheres)
    error[_of(part, faces.kind) != np.where(mirrors.flat, "plane", "sphere")] = np.inf
    limit = SURFACE_MM * max(1.0, float(np.nanmax(np.abs(centre), initial=0)) / 100)
    return worst_of(name, mirrors.ids, error, limit, "mm")


def outward(name: CheckName, part: FrontComparison) -> Check:
    """Mirrors are convex seen from outside the solid; `surfaces` tests where planes face."""
    outward = _of(part, part.front.outward)
    inward = [part.mirrors.ids[k] for k in np.flatnonzero(~outward).tolist()]
    detail = f"the solid lies on the wrong side: {short_list(inward)}"
    return at_most(name, len(inward), 0, detail)


def areas(name: CheckName, part: FrontComparison) -> Check:
    """Each mirror's area is its cell's, so that no face is the rest of its sphere."""
    error = np.abs(_of(part, part.front.area) / part.cells.area - 1)
    return worst_of(name, part.mirrors.ids, error, CELL_SHARE, "of its cell's area off")


def centroids(name: CheckName, part: FrontComparison) -> Check:
    """The middle of each mirror's area is its cell's."""
    centroid = part.cells.first / part.cells.area[:, None]
    error = np.linalg.norm(_of(part, part.front.middle) - centroid, axis=1)
    return worst_of(name, part.mirrors.ids, error, MIDDLE_MM, "mm")


def front_volume(name: CheckName, part: FrontComparison) -> Check:
    """Volume between the origin and all mirrors: what the faces enclose against the closed form."""
    faces = part.front
    area, middle = _of(part, faces.area), _of(part, faces.middle)
    centre, radius = _of(part, faces.point), _of(part, faces.radius)
    normal = _of(part, faces.normal)
    # On a sphere x.n = r + C.(x - C)/r; on a plane it is the same everywhere.
    spheres = radius + (centre * (middle - centre)).sum(axis=1) / radius
    height = np.where(part.mirrors.flat, (middle * normal).sum(axis=1), spheres)
    volume, expected = float((height * area).sum() / 3), float(part.cells.volume.sum())
    return at_most(
        name,
        abs(volume / expected - 1),
        CELL_SHARE,
        f"{volume:.6f} mm^3 under the mirrors, {expected:.6f} by mirrors.csv alone",
    )


def walls(name: CheckName, part: FrontComparison) -> Check:
    """The walls of pedestals lean, and their grooves are deep, as the spec has them."""
    grooves = require(part.grooves, "the mirrors stand on no pedestals")
    pinhole, side = part.camera.pinhole, float(np.sign(part.camera.pinhole[0]))
    planes = bounds(side, part.export.foot_z_mm)
    width = part.export.spec.shell.groove_mm
    errors = wall_errors(grooves, part.mirrors.surfaces(), pinhole, planes, width)
    return worst_of(name, grooves.names, errors, SURFACE_MM, "mm")


def ends(name: CheckName, part: FrontComparison) -> Check:
    """Corners, edges and faces end in the planes of seam and foot."""
    solid = part.file.mass
    return ends_check(name, part.export, part.part, (solid.low, solid.high), ENDS_MM)


def _of(part: FrontComparison, column: NDArray[Any]) -> NDArray[Any]:
    """(m, ...) the faces' figures in the order of the mirrors; NaN or empty for none."""
    values = column[part.face].copy()
    missing = part.face < 0
    values[missing] = np.nan if values.dtype.kind == "f" else np.zeros((), dtype=values.dtype)
    return values


def worst_of(name: CheckName, ids: Sequence[str], error: Floats, limit: float, unit: str) -> Check:
    """The worst mirror; one without a face counts as infinitely wrong."""
    error = np.where(np.isnan(error), np.inf, error)
    return each_at_most(name, ids, error, limit, unit)


WALLS: Checks = {"step walls": ("mm", walls)}
CHECKS: Checks = {
    "step names": ("missing or extra", names),
    "step surfaces": ("mm", surfaces),
    "step outward": ("turned faces", outward),
    "step cells": ("of the area", areas),
    "step cell centroids": ("mm", centroids),
    "step front volume": ("of the volume", front_volume),
    "step seam and foot": ("mm", ends),
}
