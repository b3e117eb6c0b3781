"""A machine as it was built: what its calibration changes in coverage, models and tolerances."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.cad.formats.assembly import ColouredSolid, SolidGroup, write_assembly
from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.kernel.solids import common, one_solid, sphere
from tbcad.common.figure_files import figure_file, shade_bytes
from tbcad.common.results import Table
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import mirror_ids
from tbcad.core.optics.windows import cell_windows
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan, PrototypeRun, read_plan
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.records.tables import RayRow
from tbcad.rig.machine.designed import is_cap, machine_runs, stops_known
from tbcad.rig.machine.machine import RECORD, Machine, read_machine
from tbcad.types import Floats

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SAME_MM = 1e-6  # centres and radii of a ball's front and body; a cap's are apart
UM_PER_MM = 1000.0
LEAST_BALLS = 3  # whose places tell a motion of the whole base from errors of balls
STEPS = (1.0, 2.0, 5.0)  # of the scale's ends, times powers of ten
SCHEMA = "tbcad-as-built/1"
STEP, TABLE, LEGEND, AS_BUILT = "as_built.step", "deviations.csv", "legend.png", "as_built.json"
COLUMNS = (
    *("ball", "x_mm", "y_mm", "z_mm", "radius_mm"),
    *("dx_um", "dy_um", "dz_um", "distance_um", "radius_error_um", "colour"),
)
LEGEND_INCHES, SHADES = (6.4, 1.0), 560
CALIBRATE = "calibrate again with tbcad calibrate"
AXES = 2  # of the plane at the object in which a ray may be off
PERCENT = 95.0
RAY_FIGURES = ("sigma_mm", "sigma_mrad", "pixel_mm")
"""Standard deviations of place at the object and of direction; width of a pixel there."""


@dataclass(frozen=True)
class Deviations:
    """Position errors of k balls from the designed base after rigid alignment."""

    offset: Floats  # of the centres, in the frame of the design, mm, (k, 3)
    radius: Floats  # measured less designed, mm, (k,)
    shift: Floats  # of the whole base, mm, (3,)
    turn: Floats  # rotation vector of the whole base about the origin, radians, (3,)

    @property
    def distance_um(self) -> Floats:
        """Of the centres from where the base should have them, micrometres, (k,)."""
        return UM_PER_MM * norm(self.offset)

    @property
    def scale_um(self) -> float:
        """End of a scale from 0 that holds all distances, micrometres."""
        return round_up(float(self.distance_um.max()))


def deviations(machine: Machine, plan: Plan) -> Deviations:
    """Compare a calibrated machine with its plan, which has as many balls, both without weight.

    Caps are compared by their apices, about which their radii differ.
    """
    designed, found = plan.centre - plan.sag, machine.centre + _growth(machine, plan)
    turn, shift = Rotation.identity(), np.zeros(3)
    if len(designed) >= LEAST_BALLS:
        middles = designed.mean(axis=0), found.mean(axis=0)
        turn, _ = Rotation.align_vectors(found - middles[1], designed - middles[0])
        shift = middles[1] - turn.apply(middles[0])
    offset = found - turn.apply(designed) - shift
    return Deviations(offset, machine.radius - plan.radius, shift, turn.as_rotvec())


def _growth(machine: Machine, plan: Plan) -> Floats:
    """By how much centres of caps are farther from their apices than in the plan, mm, (k, 3)."""
    growth = np.where(is_cap(plan), machine.radius - plan.radius, 0.0)
    return np.asarray(growth[:, None] * plan.normal)


def round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, 20 ... from a value on; 1 for less."""
    power = 10.0 ** int(np.floor(np.log10(max(value, 1.0))))
    return next(step * power for step in (*STEPS, 10.0) if step * power >= value)


def colours(share: Floats) -> Floats:
    """Colours (n, 3), 0 to 1, of shares (n,) of the scale, for any colour vision."""
    return shade_bytes(share) / 255


def ball_group(machine: Machine, plan: Plan, found: Deviations) -> SolidGroup:
    """All balls at base angle zero; a cap is what its reflecting sphere and its body share."""
    shades = colours(found.distance_um / found.scale_um).tolist()
    bodies, fronts = [], machine.centre + _growth(machine, plan)
    for k, (red, green, blue) in enumerate(shades):
        name = f"ball_{k + 1}"
        shape = sphere(machine.centre[k], float(machine.radius[k]))
        apart = abs(plan.centre[k] - plan.body_centre[k]).max()
        if max(apart, abs(plan.radius[k] - plan.body_radius[k])) > SAME_MM:
            body = fronts[k] + plan.body_centre[k] - plan.centre[k]
            cap = common(shape, sphere(body, float(plan.body_radius[k])))
            shape = one_solid(name, cap)
        bodies.append(ColouredSolid(name, shape, (red, green, blue, 1.0)))
    return SolidGroup("balls", tuple(bodies))


def as_built(calibration: Path, exports: Path, folder: Path) -> dict[str, Any]:
    """Write the files of a machine as built and return their record, or an InputError."""
    machine, _ = read_machine(calibration / RECORD)
    plan = read_plan(read_export(exports))
    if len(machine.radius) != len(plan):
        raise InputError(
            f"{calibration} has {len(machine.radius)} balls, {exports} has {len(plan)}: name the "
            "build that was calibrated with --exports"
        )
    found = deviations(machine, plan)
    write_assembly(folder / STEP, "prototype_as_built", [ball_group(machine, plan, found)])
    write_table(folder / TABLE, COLUMNS, _rows(machine, found))
    (folder / LEGEND).write_bytes(legend(found.scale_um))
    record = {
        "schema": SCHEMA,
        "calibration": str(calibration),
        "exports": str(exports),
        "balls": len(plan),
        "scale_um": [0.0, found.scale_um],
        "base": {"shift_mm": found.shift.tolist(), "turn_deg": np.degrees(found.turn).tolist()},
        "largest_um": float(found.distance_um.max()),
        "median_um": float(np.median(found.distance_um)),
        "files": {"solids": STEP, "table": TABLE, "legend": LEGEND},
    }
    (folder / AS_BUILT).write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return record


def legend(scale_um: float) -> bytes:
    """A picture of the colours from 0 to the end of the scale, PNG."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        shades = colours(np.linspace(0, 1, SHADES))[None]
        axes.imshow(shades, extent=(0, scale_um, 0, 1), aspect="auto")
        axes.set(yticks=[], xlabel="centre off the designed base, micrometres")

    return figure_file(draw, LEGEND_INCHES)


def _rows(machine: Machine, found: Deviations) -> list[Row]:
    """Measured centre at base angle zero, radius, and what they are off by."""
    shades = np.rint(255 * colours(found.distance_um / found.scale_um)).astype(int)
    off_um = [UM_PER_MM * found.offset, found.distance_um, UM_PER_MM * found.radius]
    table = np.column_stack([machine.centre, machine.radius, *off_um]).tolist()
    cells = (
        (number, *values, "#{:02x}{:02x}{:02x}".format(*shade))
        for number, (values, shade) in enumerate(zip(table, shades, strict=True), 1)
    )
    return [dict(zip(COLUMNS, row, strict=True)) for row in cells]


@dataclass(frozen=True)
class AsBuiltTolerance:
    """Coverage and pointing of a calibrated machine, by the mirrors of both cameras."""

    target: float  # coverage that is wanted, mm
    # of the mirrors whose stops are calibrated: coverage with windows where the balls are, and
    # figures of rays.csv
    mirrors: Table
    absent: tuple[str, ...]  # ids of the others
    worst: Floats  # minimum coverage of each simulated truth, mm, (s,)

    @property
    def share(self) -> float:
        """Share of the simulated truths in which all mirrors reach the target."""
        return float((self.worst >= self.target).mean())


def as_built_tolerance(
    calibration: Path, exports: Path, builds: int, seed: int
) -> AsBuiltTolerance:
    """Study one machine with what its calibration leaves unknown, by so many simulated truths.

    A ray that is off by d at the object moves the edge of what its mirror shows by at most d, and
    costs at most 2 d of coverage. The errors d of the mirrors are drawn independently, each with
    its own standard deviation of rays.csv.

    InputError: one cannot be read, or they do not belong together.
    """
    export = read_export(exports)
    plan, (machine, frames) = read_plan(export), read_machine(calibration / RECORD)
    rays, known = {ray.mirror: ray for ray in RayRow.read(calibration)}, stops_known(plan, frames)
    records, absent = list[dict[str, Any]](), list[str]()
    for half, run in enumerate(machine_runs(export, plan, machine, frames)):
        names = mirror_ids(run.reflector.camera_id, len(run.reflector))
        calibrated = known[half, plan.stop[half]]
        for name, shown_mm, seen in zip(names, _coverage(run).tolist(), calibrated, strict=True):
            if not seen or name not in rays:
                absent.append(name)
                continue
            figures = {figure: getattr(rays[name], figure) for figure in RAY_FIGURES}
            records.append({"mirror": name, "coverage_mm": shown_mm, **figures})
    if not records:
        raise InputError(f"{calibration / RayRow.FILE} names no mirror of {exports}: {CALIBRATE}")
    mirrors = Table.of_records("as-built", records)
    shown, place = mirrors.numbers("coverage_mm"), mirrors.numbers("sigma_mm")
    random, size = np.random.default_rng(seed), (len(place), AXES)
    lost = (2 * norm(random.standard_normal(size)) * place / np.sqrt(AXES) for _ in range(builds))
    worst = np.array([(shown - one).min() for one in lost])
    return AsBuiltTolerance(export.capture_mm, mirrors, tuple(absent), worst)


def tolerance_record(found: AsBuiltTolerance, builds: int, seed: int) -> dict[str, Any]:
    """The object of as-built.json."""
    coverage, place, turn, pixel = map(found.mirrors.numbers, ("coverage_mm", *RAY_FIGURES))
    return {
        "schema": "tbcad-as-built-tolerance/1",
        "target_mm": found.target,
        "builds": builds,
        "seed": seed,
        "share_good": found.share,
        "coverage_mm_minimum": float(coverage.min()),
        "coverage_mm_worst_median": float(np.median(found.worst)),
        "place_mm_median": float(np.median(place)),
        "place_mm_95": float(np.percentile(place, PERCENT)),
        "turn_mrad_median": float(np.median(turn)),
        "turn_mrad_95": float(np.percentile(turn, PERCENT)),
        "pixel_mm_median": float(np.median(pixel)),
        "mirrors": len(place),
        "mirrors_not_calibrated": list(found.absent),
    }


def summary(found: AsBuiltTolerance) -> str:
    """The result in words."""
    coverage, place, turn, pixel = map(found.mirrors.numbers, ("coverage_mm", *RAY_FIGURES))
    lost = f" {len(found.absent)} mirrors are not calibrated." if found.absent else ""
    return (
        f"As calibrated, {found.share:.0%} of {len(found.worst)} simulated truths show "
        f"{found.target:g} mm by all {len(place)} mirrors: minimum coverage {coverage.min():.2f} "
        f"mm as calibrated, {np.median(found.worst):.2f} mm in the median truth. Rays are known to "
        f"{np.median(place):.3f} mm at the object ({np.percentile(place, PERCENT):.3f} at "
        f"{PERCENT:.0f} %) and {np.median(turn):.2f} mrad; a pixel is {np.median(pixel):.3f} mm "
        f"wide there.{lost}"
    )


def _coverage(run: PrototypeRun) -> Floats:
    """Coverage of the mirrors of a run, with windows where the balls are, mm, (m,)."""
    turn = Rotation.from_matrix(np.swapaxes(run.window_rotation, 1, 2)).as_rotvec()
    angle = norm(turn)
    axis = np.where(angle[:, None] > 0, turn / np.maximum(angle, 1e-300)[:, None], [1.0, 0, 0])
    surfaces = run.ball_surfaces
    windows = cell_windows(run.reflector.cells, run.reflector.camera.pinhole)
    return windows.coverage(surfaces.centre, surfaces.radius, axis, angle, run.camera.pinhole)
