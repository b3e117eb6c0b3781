"""From a build and a process chain to the files of an order: a table, STEP files, a record.

Tolerances are read back from STEP as a reader gets them, and compared with those that were meant.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from math import ceil, isclose, log
from pathlib import Path
from typing import Any

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
from tbcad.core.optics.reflection import SCATTERED, roughness_nm
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.mirror_limits.held import (
    GOOD,
    TWO_SIGMA,
    Chain,
    chain_of,
    confidence,
    measurements,
    sampled,
)
from tbcad.mirror_limits.sensitivity import (
    MM_PER_UM,
    Deviation,
    MirrorLimits,
    Sensitivities,
    mirror_limits,
    sensitivities,
    whole_margin_steps,
)
from tbcad.options.builds import OrderOptions
from tbcad.shell.files import wall_names
from tbcad.tolerancing.montecarlo.coverage import coverage
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.process.process import Process
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
    """Both halves of a build with their part of the limits, and of what a chain holds."""
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


BUILDS, SEED = 50, 1


def checked_export(folder: Path, process: Process, chain: str) -> ExportedDesign:
    """Read a build whose shells a chain can make: its solids are there, no mirror is planar."""
    export, remedies = read_export(folder), {"shell": "build the shell too, tbcad build"}
    if process.mandrel_cutter_mm is not None:
        way = "tbcad build --set shell.negative=true, or with --process"
        remedies["mandrel"] = f"{chain} takes shells from mandrels: {way} {chain}"
    for solid, remedy in remedies.items():
        missing = (one for half in "ab" if not (one := folder / f"{solid}_{half}.step").is_file())
        if file := next(missing, None):
            raise InputError(f"{file} is not there: {remedy}")
    if not all((one.mirrors.curvature > 0).all() for one in export.reflectors):
        raise InputError(f"{folder}: its mirrors are planar: limits are for spheres only")
    return export


def write_order(
    export: ExportedDesign, process: Process, options: OrderOptions, folder: Path
) -> dict[str, Any]:
    """Write limits of every mirror and what a chain holds of them into a folder; the record.

    InputError if the shell leaves no deviation, the mandrel's cutter does not fit, or solids are
    not those of the record.
    """
    options.progress("sensitivities")
    found, limits = found_limits(export, options.wanted)
    options.progress(process.name)
    chain = chain_of(export, process, options.process, limits, options.wanted)
    files = [RECORD]
    of_shells = halves(export, limits, chain.each)
    shares = np.split(chain.mandrel_share, 2)
    for half, share in zip(of_shells, shares, strict=True):
        mandrel = [half.mandrel(share)] if process.mandrel_cutter_mm is not None else []
        files.append(write_table_of(folder, half))
        for one in (half, *mandrel):
            options.progress(one.name)
            files.append(write_solid(folder, export.folder, one, _notes(chain)))
    record = _record(export, found, limits, chain) | {"files": sorted(files)}
    (folder / RECORD).write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return record


def _notes(chain: Chain) -> dict[str, str]:
    """Notes of STEP files: each figure with what the chain holds of it."""
    told = {f"chain holds {one.name}": one.text for one in chain.figures}
    return {"chain": f"{chain.process.name}: {chain.verdict}"} | told


def _record(
    export: ExportedDesign, found: Sensitivities, limits: MirrorLimits, chain: Chain
) -> dict[str, Any]:
    each = {"smallest": limits.each.min(axis=0), "median": np.median(limits.each, axis=0)}
    process, numbers = chain.process, sampled(export.reflectors[0].mirrors.apex, limits)
    ids = [mirror_ids(one.camera_id, len(one)) for one in export.reflectors]
    return {
        "schema": SCHEMA,
        "exports": str(export.folder),
        "target_mm": export.capture_mm,
        "yield": chain.wanted,
        "foot_z_mm": export.reflectors[0].foot,
        "simulated_minimum_mm": minimum_at_limits(export, limits),
        "designed_minimum_mm": float(found.coverage.min()),
        "limits": {
            **{name: dict(zip(UNITS, row.tolist(), strict=False)) for name, row in each.items()},
            "seat_um": limits.seat_um,
        },
        "chain": {
            "name": process.name,
            "title": process.title,
            "good": chain.good,
            "holds": chain.holds,
            "verdict": chain.verdict,
            "mandrel_cutter_mm": process.mandrel_cutter_mm,
            "coat": {
                "mean_um": process.coating_um.mean,
                "two_sigma_um": TWO_SIGMA * process.coating_um.sigma,
            },
            "smallest_radius_mm": min(float(one.mirrors.radius.min()) for one in export.reflectors),
            "figures": [asdict(one) for one in chain.figures],
            "steps": [step.model_dump(mode="json", exclude_none=True) for step in process.made],
        },
        "finish": {"rq_nm": roughness_nm(), "scattered": SCATTERED},
        "measuring": measurements(export, limits, process.made, chain.mandrel_share),
        "samples": {
            "mirrors": [[names[k] for k in numbers] for names in ids],
            "good": GOOD,
            "confidence": confidence(len(ids) * len(numbers)),
            "for_95": ceil(log(1 - 0.95) / log(GOOD)),
        },
    }


def found_limits(export: ExportedDesign, wanted: float) -> tuple[Sensitivities, MirrorLimits]:
    """Losses of a build's virtual cameras, and the limits that follow; see `mirror_limits`.

    Losses are taken for small deviations. They grow faster than those: another edge of a cell
    becomes the one that limits its coverage. Where edges do not depend on neighbours, deviations
    are large enough for that. So losses are then taken for deviations that would cost the whole
    margin. Each is convex, so what several kinds cost together is at most the mean of what each
    costs when it is as many times as large.
    """
    found = sensitivities(export.reflectors)
    limits = mirror_limits(found, export.capture_mm, wanted)
    if minimum_at_limits(export, limits) >= export.capture_mm:
        return found, limits
    radius = np.concatenate([one.mirrors.radius for one in export.reflectors])
    steps = whole_margin_steps(found, limits, radius)
    found = sensitivities(export.reflectors, steps)
    return found, mirror_limits(found, export.capture_mm, wanted).within(steps, found)


def minimum_at_limits(export: ExportedDesign, limits: MirrorLimits, builds: int = BUILDS) -> float:
    """Minimum coverage of simulated shells whose mirrors are all at their limits, mm.

    Each deviation is at its limit one way or the other, at random; tilts in random directions.
    """
    models, generator = edge_models(export.reflectors), np.random.default_rng(SEED)
    draws = []
    for model, each in zip(models, np.split(limits.each, 2), strict=True):
        shape = (builds, len(model))
        sign = generator.choice([-1.0, 1.0], (2, *shape))
        angle, wall = generator.uniform(0, 2 * np.pi, shape), np.zeros(shape)
        tilt = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * each[:, 1, None]
        if len(model.walls):
            wall = generator.choice([-1.0, 1.0], shape) * each[:, 3]
        off = Deviation(sign[0] * each[:, 0], tilt, sign[1] * each[:, 2], wall)
        draws.append(off.draws(model))
    return float(coverage(models, (draws[0], draws[1]), worst_only=True).min())
