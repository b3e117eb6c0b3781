"""The files of an order: a table and STEP files with tolerances for each half, a record.

Tolerances are read back from STEP as a reader gets them, and compared with those that were meant.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path

import numpy as np

from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.formats.step import read_named_solid
from tbcad.cad.formats.step_tolerances import (
    FaceTolerance,
    FaceTolerances,
    check_read_back,
    write_tolerances,
)
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.solids import cylinder_radius
from tbcad.core.mirrors.array import mirror_ids
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
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


@dataclass(frozen=True)
class Half:
    """One half of the shell, as its solid is."""

    name: str  # of its solid, "shell_a"
    ids: tuple[str, ...]
    surfaces: Surfaces  # of the solid, below the coat
    limits: MirrorLimits
    chain: Floats  # two standard deviations of what the chain makes, (m, kinds)
    dowel_mm: float  # diameter of the holes for dowel pins
    walls: tuple[tuple[str, ...], ...]  # faces of each mirror's pedestal; none where spheres meet

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


def _walls(ids: tuple[str, ...], cells: Cells) -> tuple[tuple[str, ...], ...]:
    """Walls of each mirror's pedestal, as `Half` has them."""
    if not isinstance(cells, PedestalCells):
        return ()
    walls: tuple[list[str], ...] = tuple([] for _ in ids)
    for mirror, name in zip(cells.walls[:, 0].tolist(), wall_names(ids, cells), strict=True):
        walls[mirror].append(name)
    return tuple(map(tuple, walls))


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
    check_read_back(folder / step, given)
    return step


def tolerances(half: Half, dowel: str) -> FaceTolerances:
    """What the faces of a half may be off."""
    seat = half.limits.seat_um * MM_PER_UM
    radii = zip(
        half.ids, half.limits.each[:, 2].tolist(), half.surfaces.radius.tolist(), strict=True
    )
    profiles = zip(half.ids, half.profile_mm.tolist(), strict=True)
    return FaceTolerances(
        datums=DATUM_FACES | {"C": dowel},
        each=(
            *(FaceTolerance("flatness", (face,), seat) for face in DATUM_FACES.values()),
            *(FaceTolerance("profile", (name,), width) for name, width in profiles),
            *(
                FaceTolerance("profile", names, width)
                for names, width in zip(half.walls, half.wall_profile_mm, strict=True)
            ),
            *(FaceTolerance("radius", (name,), limit, radius) for name, limit, radius in radii),
        ),
        notes=notes(half.wall_um),
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
