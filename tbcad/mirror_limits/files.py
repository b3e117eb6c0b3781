"""The files of an order: a table and STEP files with tolerances for each half, a record.

Tolerances are read back from STEP as a reader gets them, and compared with those that were meant.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import TypeVar

import numpy as np

from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.formats.step import StepError, read_named_solid
from tbcad.cad.formats.step_tolerances import (
    FaceTolerances,
    ReadTolerance,
    read_tolerances,
    write_tolerances,
)
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.solids import cylinder_radius
from tbcad.core.mirrors.array import mirror_ids
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.optics.reflection import roughness_nm
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.mirror_limits.sensitivity import MM_PER_UM, MirrorLimits
from tbcad.shell.files import wall_names
from tbcad.types import Floats

SCHEMA = "tbcad-order/1"
RECORD = "order.json"
DATUM_FACES = {"A": "foot", "B": "seam"}
UNITS = ("offset_um", "tilt_mrad", "radius_mm", "wall_um")
SPHERE_KINDS = UNITS[:3]
COLUMNS = (
    *("id", "centre_x_mm", "centre_y_mm", "centre_z_mm", "radius_mm"),
    *("apex_x_mm", "apex_y_mm", "apex_z_mm", "normal_x", "normal_y", "normal_z"),
    *("offset_limit_um", "tilt_limit_mrad", "radius_limit_mm", "profile_mm"),
    *("offset_sigma_um", "tilt_sigma_mrad", "radius_sigma_mm"),
    *("offset_chain_um", "tilt_chain_mrad", "radius_chain_mm"),  # two standard deviations
)
WALL_COLUMNS = ("wall_limit_um", "wall_sigma_um", "wall_chain_um")  # of mirrors on pedestals
Key = TypeVar("Key", str, int, frozenset[str])
SAME = 1e-9  # mm: numbers in a file have 15 digits
SAME_PLANE = 1e-6  # of normal and distance (mm): at n = 18 no two walls are closer than 2e-4
EITHER_WAY = np.array([1.0, -1.0])


@dataclass(frozen=True)
class Half:
    """One half of the shell, as its solid is."""

    name: str  # of its solid, "shell_a"
    ids: tuple[str, ...]
    surfaces: Surfaces  # of the solid, below the coat
    limits: MirrorLimits
    chain: Floats  # two standard deviations of what the chain makes, (m, kinds)
    dowel_mm: float  # diameter of the holes for dowel pins
    # of each mirror's pedestal: names of the faces, with a point (mm) and the normal of their
    # planes, (6,); none where spheres meet
    walls: tuple[dict[str, Floats], ...]

    @property
    def profile_mm(self) -> Floats:
        """Width of the zone about each mirror that its offset leaves, mm, (m,)."""
        return np.round(2 * MM_PER_UM * self.limits.each[:, 0], 6)

    @property
    def wall_um(self) -> Floats | None:
        """By how much the walls of each pedestal may be off, (m,); None where spheres meet."""
        each = self.limits.each
        return each[:, len(SPHERE_KINDS)] if each.shape[1] > len(SPHERE_KINDS) else None

    @property
    def wall_profile_mm(self) -> list[float]:
        """Width of the zones about the walls of each pedestal, mm; none where spheres meet."""
        wall = self.wall_um
        return [] if wall is None else np.round(2 * MM_PER_UM * wall, 6).tolist()

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the table."""
        return COLUMNS if self.wall_um is None else COLUMNS + WALL_COLUMNS

    def mandrel(self, share: Floats) -> "Half":
        """Its negative, which may use a share (m, kinds) of the limits."""
        name = self.name.replace("shell", "mandrel")
        return replace(self, name=name, limits=self.limits.part(share))

    def rows(self) -> list[Row]:
        """Rows of the table."""
        each, sigma, chain = (
            np.hsplit(of, [len(SPHERE_KINDS)])
            for of in (self.limits.each, self.limits.sigma, self.chain)
        )
        numbers = np.column_stack(
            [
                *(self.surfaces.centre, self.surfaces.radius, self.surfaces.apex),
                *(self.surfaces.normal, each[0], self.profile_mm, sigma[0], chain[0]),
                *(each[1], sigma[1], chain[1]),
            ]
        ).tolist()
        named = zip(self.ids, numbers, strict=True)
        return [dict(zip(self.columns, (name, *row), strict=True)) for name, row in named]


def halves(export: ExportedDesign, limits: MirrorLimits, chain: Floats) -> tuple[Half, Half]:
    """Both halves of an export with their part of the limits, and of what a chain holds."""
    coat = export.spec.mirrors.coating_um * MM_PER_UM
    m = len(export.reflectors[0])
    a, b = (
        Half(
            f"shell_{one.camera_id}",
            tuple(mirror_ids(one.camera_id, m)),
            one.mirrors.offset(-coat),
            MirrorLimits(limits.each[k * m :][:m], limits.sigma[k * m :][:m], limits.seat_um),
            chain[k * m :][:m],
            export.spec.shell.foot_flange.dowel_hole_mm,
            _walls(tuple(mirror_ids(one.camera_id, m)), one.cells),
        )
        for k, one in enumerate(export.reflectors)
    )
    return a, b


def _walls(ids: tuple[str, ...], cells: Cells) -> tuple[dict[str, Floats], ...]:
    """Walls of each mirror's pedestal, as `Half` has them; none where spheres meet."""
    if not isinstance(cells, PedestalCells):
        return ()
    planes = cells.surfaces.subset(slice(cells.mirrors + PLANES, None))
    poses = zip(
        cells.walls[:, 0].tolist(),
        wall_names(ids, cells),
        np.hstack([planes.apex, planes.normal]),
        strict=True,
    )
    walls: tuple[dict[str, Floats], ...] = tuple({} for _ in ids)
    for mirror, name, plane in poses:
        walls[mirror][name] = plane
    return walls


def write_table_of(folder: Path, half: Half) -> str:
    """Write the table of one half, and return its name."""
    table = f"inspection_{half.name[-1]}.csv"
    write_table(folder / table, half.columns, half.rows())
    return table


def write_solid(folder: Path, export: Path, half: Half, chain: Mapping[str, str]) -> str:
    """Write a half's STEP file with notes on its chain, read the tolerances back, and name it.

    InputError if the export has no such solid, or it is not that of its mirrors.
    """
    step = f"{half.name}_tolerances.step"
    solid = read_named_solid(export / f"{half.name}.step")
    names = {name for name, _ in solid.faces}
    missing = sorted({*half.ids, *DATUM_FACES.values()} - names)
    if missing:
        raise InputError(f"{export / half.name}.step has no face {missing[0]}: run tbcad build")
    given = tolerances(half, dowel_face(solid, half.dowel_mm))
    write_tolerances(folder / step, solid, replace(given, notes={**given.notes, **chain}))
    check_read_back(folder / step, given, half)
    return step


def tolerances(half: Half, dowel: str) -> FaceTolerances:
    """What the faces of a half may be off."""
    seat = half.limits.seat_um * MM_PER_UM
    radius = zip(half.surfaces.radius.tolist(), half.limits.each[:, 2].tolist(), strict=True)
    return FaceTolerances(
        datums=DATUM_FACES | {"C": dowel},
        flatness=dict.fromkeys(DATUM_FACES.values(), seat),
        profile=dict(zip(half.ids, half.profile_mm.tolist(), strict=True)),
        radius=dict(zip(half.ids, radius, strict=True)),
        notes=notes(half.wall_um),
        common_profile=dict(zip(map(tuple, half.walls), half.wall_profile_mm, strict=True)),
    )


def dowel_face(solid: Solid, diameter: float) -> str:
    """Name of the first dowel hole in the foot flange; InputError if it has none."""
    holes = (one for one in solid.faces if one[0].startswith("foot_hole"))
    dowels = [name for name, face in holes if isclose(2 * cylinder_radius(face), diameter)]
    if not dowels:
        raise InputError(
            f"{solid.name} has no dowel hole for datum C: make shell.foot_flange.dowels 1 or more"
        )
    return dowels[0]


def notes(wall_um: Floats | None = None) -> dict[str, str]:
    """What tolerances of faces cannot say; walls of pedestals may be off by micrometres, (m,)."""
    walls = {}
    if wall_um is not None:
        limit = f"{wall_um.min():.1f} um along their normals, or as the zones allow"
        walls["walls of grooves"] = f"zones hold at the edges of mirrors: within {limit}"
    return walls | {
        "surface finish": f"mirrors polished, Rq {roughness_nm():.1f} nm or better",
        "limits": "of mirrors: as reflecting, coated; each zone by its own mirror",
        "datums": "A foot plane, B seam plane, C dowel hole",
    }


def check_read_back(path: Path, given: FaceTolerances, half: Half) -> None:
    """Compare all zones and radii in a file with what they should be, by the faces of a half.

    StepError if one is missing, doubled, or not as given: a fault of tbcad.
    """
    read, centres = read_tolerances(path), dict(zip(half.ids, half.surfaces.centre, strict=True))
    walls = {name: plane for of_mirror in half.walls for name, plane in of_mirror.items()}
    flat = sorted(one.value for one in read if one.kind == "flatness")
    written = sorted(given.flatness.values())
    _same(path, "flatness", dict(enumerate(flat)), dict(enumerate(written)))
    zones = [one for one in read if one.kind == "profile"]
    if any(one.datums != tuple(given.datums) for one in zones):
        raise StepError(f"{path.name}: a zone is not in the frame of the datums")
    of_walls = [one for one in zones if one.planes]
    of_mirrors = [one for one in zones if not one.planes]
    _same(path, "zones", _by_mirror(of_mirrors, centres), given.profile)
    common = {frozenset(names): width for names, width in given.common_profile.items()}
    _same(path, "zones of walls", _by_walls(of_walls, walls), common)
    radii = [one for one in read if one.kind == "radius"]
    limits = {name: limit for name, (_, limit) in given.radius.items()}
    nominal = {name: radius for name, (radius, _) in given.radius.items()}
    _same(path, "limits of radii", _by_mirror(radii, centres), limits)
    _same(path, "radii", _by_mirror(radii, centres, "nominal"), nominal)


def _by_mirror(
    read: list[ReadTolerance], centres: Mapping[str, Floats], which: str = "value"
) -> dict[str, float]:
    """Values by the mirror on whose sphere each face is."""
    names, known = list(centres), np.array(list(centres.values()))
    values = {}
    for one in read:
        if one.centre is None:
            raise StepError("a tolerance of a mirror is not on a sphere")
        distance = np.linalg.norm(known - one.centre, axis=1)
        values[names[int(distance.argmin())]] = float(getattr(one, which))
    return values


def _by_walls(
    read: list[ReadTolerance], walls: Mapping[str, Floats]
) -> dict[frozenset[str], float]:
    """Values by the names of the walls whose planes the faces are on."""
    names, known = list(walls), _plane_numbers(np.array(list(walls.values())).reshape(-1, 2, 3))
    values = {}
    for one in read:
        planes = _plane_numbers(np.array(one.planes))
        either = EITHER_WAY[:, None, None] * planes[:, None, None]
        distance = np.linalg.norm(either - known, axis=3).min(axis=1)
        if distance.min(axis=1).max() > SAME_PLANE:
            raise StepError("a zone is on no wall of a pedestal")
        values[frozenset(names[k] for k in distance.argmin(axis=1))] = one.value
    return values


def _plane_numbers(planes: Floats) -> Floats:
    """Normals and distances from the origin (mm) of planes by points and normals, (w, 4)."""
    point, normal = planes[:, 0], planes[:, 1]
    return np.column_stack([normal, (point * normal).sum(axis=1)])


def _same(path: Path, what: str, read: Mapping[Key, float], given: Mapping[Key, float]) -> None:
    if read.keys() != given.keys():
        raise StepError(f"{path.name}: {len(read)} {what} are read, {len(given)} were written")
    if any(abs(read[key] - given[key]) > SAME for key in read):
        raise StepError(f"{path.name}: {what} are read otherwise than they were written")
