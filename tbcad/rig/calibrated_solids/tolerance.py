"""What a calibration leaves unknown of one machine, in place of a process's random errors."""

from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.common.results import Table
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.windows import cell_windows
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.plan import Plan, read_plan
from tbcad.light.simulate.prototype.run import PrototypeRun
from tbcad.light.simulate.scene.exported import read_export
from tbcad.records.tables import RayRow
from tbcad.rig.machine.photographed import machine_runs, stops_known
from tbcad.rig.machine.record import RECORD, read_machine
from tbcad.types import Bools, Floats

CALIBRATE = "calibrate again with tbcad calibrate"
AXES = 2  # of the plane at the object in which a ray may be off
PERCENT = 95.0


@dataclass(frozen=True)
class AsBuiltTolerance:
    """Coverage and pointing of a calibrated machine, over m mirrors of both cameras."""

    target: float  # coverage that is wanted, mm
    ids: tuple[str, ...]  # of the mirrors whose stops are calibrated, (m,)
    absent: tuple[str, ...]  # of the others
    coverage: Floats  # with windows where the balls are, mm, (m,)
    place: Floats  # root mean square distance at the object of a ray from the true one, mm, (m,)
    turn: Floats  # likewise its direction, mrad, (m,)
    pixel: Floats  # width of a pixel at the object, mm, (m,)
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

    Raises:
        InputError: one cannot be read, or they do not belong together.
    """
    export = read_export(exports)
    plan, (machine, frames) = read_plan(export), read_machine(calibration / RECORD)
    runs, known = machine_runs(export, plan, machine, frames), stops_known(plan, frames)
    names = [_names(run) for run in runs]
    rays = {ray.mirror: ray for ray in RayRow.read(calibration)}
    covered = np.concatenate([*map(_coverage, runs)])
    coverage = dict(zip(chain(*names), covered.tolist(), strict=True))
    ids = [name for half in range(len(runs)) for name in _known(plan, known, half, names[half])]
    ids = [name for name in ids if name in rays]
    if not ids:
        raise InputError(f"{calibration / RayRow.FILE} names no mirror of {exports}: {CALIBRATE}")
    shown = np.array([coverage[name] for name in ids])
    place = np.array([rays[name].sigma_mm for name in ids])
    random = np.random.default_rng(seed)
    worst = np.array([(shown - 2 * _drawn(random, place)).min() for _ in range(builds)])
    return AsBuiltTolerance(
        target=export.capture_mm,
        ids=tuple(ids),
        absent=tuple(sorted({*coverage} - {*ids})),
        coverage=shown,
        place=place,
        turn=np.array([rays[name].sigma_mrad for name in ids]),
        pixel=np.array([rays[name].pixel_mm for name in ids]),
        worst=worst,
    )


def tolerance_table(found: AsBuiltTolerance) -> Table:
    """Every mirror."""
    return Table.of_columns(
        "as-built",
        {
            "mirror": found.ids,
            "coverage_mm": found.coverage,
            "sigma_mm": found.place,
            "sigma_mrad": found.turn,
            "pixel_mm": found.pixel,
        },
    )


def tolerance_record(found: AsBuiltTolerance, builds: int, seed: int) -> dict[str, Any]:
    """The object of as-built.json."""
    return {
        "schema": "tbcad-as-built-tolerance/1",
        "target_mm": found.target,
        "builds": builds,
        "seed": seed,
        "share_good": found.share,
        "coverage_mm_minimum": float(found.coverage.min()),
        "coverage_mm_worst_median": float(np.median(found.worst)),
        "place_mm_median": float(np.median(found.place)),
        "place_mm_95": float(np.percentile(found.place, PERCENT)),
        "turn_mrad_median": float(np.median(found.turn)),
        "turn_mrad_95": float(np.percentile(found.turn, PERCENT)),
        "pixel_mm_median": float(np.median(found.pixel)),
        "mirrors": len(found.ids),
        "mirrors_not_calibrated": list(found.absent),
    }


def summary(found: AsBuiltTolerance) -> str:
    """The result in words."""
    least, truth = float(found.coverage.min()), float(np.median(found.worst))
    lost = f" {len(found.absent)} mirrors are not calibrated." if found.absent else ""
    return (
        f"As calibrated, {found.share:.0%} of {len(found.worst)} simulated truths show "
        f"{found.target:g} mm by all {len(found.ids)} mirrors: minimum coverage {least:.2f} mm as "
        f"calibrated, {truth:.2f} mm in the median truth. Rays are known to "
        f"{np.median(found.place):.3f} mm at the object ({np.percentile(found.place, PERCENT):.3f} "
        f"at {PERCENT:.0f} %) and {np.median(found.turn):.2f} mrad; a pixel is "
        f"{np.median(found.pixel):.3f} mm wide there.{lost}"
    )


def _names(run: PrototypeRun) -> list[str]:
    count = len(run.reflector)
    return [f"{run.reflector.camera_id}{number:04d}" for number in range(1, count + 1)]


def _known(plan: Plan, known: Bools, half: int, names: list[str]) -> list[str]:
    """Mirrors of one run whose stops are calibrated."""
    seen = known[half, plan.stop[half]].tolist()
    return [name for name, one in zip(names, seen, strict=True) if one]


def _coverage(run: PrototypeRun) -> Floats:
    """Coverage of the mirrors of a run, with windows where the balls are, mm, (m,)."""
    turn = Rotation.from_matrix(np.swapaxes(run.window_rotation, 1, 2)).as_rotvec()
    angle = norm(turn)
    axis = np.where(angle[:, None] > 0, turn / np.maximum(angle, 1e-300)[:, None], [1.0, 0, 0])
    surfaces = run.ball_surfaces
    windows = cell_windows(run.reflector.cells, run.reflector.camera.pinhole)
    return windows.coverage(surfaces.centre, surfaces.radius, axis, angle, run.camera.pinhole)


def _drawn(random: np.random.Generator, place: Floats) -> Floats:
    """Lengths (m,) of errors in a plane with root mean squares (m,)."""
    return np.asarray(norm(random.standard_normal((len(place), AXES))) * place / np.sqrt(AXES))
