"""A run's photographs merged into the light field of the machine that took them, and its folder."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.capture.files import capture_record, write_cameras, write_record
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS
from tbcad.light.simulate.capture.photograph import CameraPhotographs, RowBand
from tbcad.light.simulate.prototype.merge import merge_photographs, merge_plan
from tbcad.light.simulate.prototype.run import PrototypeRun, ball_reflector
from tbcad.light.simulate.scene.rays import meets_sphere
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.light.simulate.scene.upper_lamps import upper_screen
from tbcad.options.machines import MergeOptions
from tbcad.records.run import LIT, Frame, exposure_name
from tbcad.records.tables import RayRow
from tbcad.rig.machine.designed import TURNS, machine_run, stops_known
from tbcad.rig.machine.machine import RECORD, Machine, read_machine
from tbcad.rig.machine.shells import NOT_SERVED, plan_of, tied
from tbcad.rig.merged_run.stop_photographs import (
    CorrectedPhotographs,
    common_exposure,
    corrections,
)
from tbcad.rig.runs import Run, check_same_export, read_run
from tbcad.types import Bools, Floats, Ints, Progress


def ray_sigmas(
    folders: Iterable[Path], mirrors: Mapping[str, int], capture_mm: float
) -> dict[str, list[float | None]]:
    """Root mean square error of the rays of each mirror where the object is, mm, by camera.

    At the centre it is `sigma_mm`; elsewhere their angle counts too, here at half the radius of the
    capture sphere. None: the calibration, whose folders may lack the table, does not say.
    """
    known = {
        ray.mirror: round(hypot(ray.sigma_mm, ray.sigma_mrad / 1000 * capture_mm / 4), 5)
        for folder in folders
        if (folder / RayRow.FILE).is_file()
        for ray in RayRow.read(folder)
    }
    return {
        camera: [known.get(f"{camera}{number + 1:04d}") for number in range(count)]
        for camera, count in mirrors.items()
    }


@dataclass(frozen=True)
class HalfMerge:
    """One run of the base, for one camera of the shell."""

    run: PrototypeRun  # where camera and balls are
    photographs: CorrectedPhotographs
    pixels: Ints  # of each mirror with a ray, filled in as the merge goes on, (m,)
    screen: Any | None = None  # bodies before the object, with their tolerance

    @property
    def camera_id(self) -> str:
        """Camera of the shell whose picture is merged."""
        return self.run.reflector.camera_id

    def bands(self, capture_mm: float, progress: Progress) -> Iterator[RowBand]:
        """Bands of the merged picture; what they lack is known when all were given."""
        in_front = partial(_shows_object, self.run.camera.pinhole, capture_mm / 2)
        frames = enumerate(self.photographs.frames)
        # The first stop with a photograph also shows what is on no mirror.
        direct = next((stop for stop, frame in frames if frame is not None), 0)
        plan = merge_plan(self.run, capture_mm / 2, in_front, direct, self.screen)
        for band in merge_photographs(plan, self.photographs, progress):
            mirror = band.rays.mirror.ravel()
            self.pixels[:] += np.bincount(mirror, minlength=len(self.pixels) + 1)[1:]
            yield band

    def missing_mirrors(self) -> dict[str, list[int]]:
        """Numbers of the mirrors without rays, from 1, by the reason."""
        reasons: dict[str, list[int]] = {}
        for mirror in np.flatnonzero(self.pixels == 0).tolist():
            reason = self.photographs.missing.get(int(self.run.stop[mirror]), "no ray by its ball")
            reasons.setdefault(reason, []).append(mirror + 1)
        return reasons


@dataclass(frozen=True)
class Merge:
    """Both runs of a folder, or the one that was photographed."""

    halves: tuple[HalfMerge, ...]  # for each camera of the shell that photographs were taken for
    capture_mm: float  # diameter of the capture sphere
    facts: dict[str, Any]
    # root mean square error of the rays of each mirror at the object, by camera; None where the
    # calibration does not say
    ray_sigma_mm: dict[str, list[float | None]]

    def cameras(self, progress: Progress) -> CameraPhotographs:
        """Each camera with what gives the bands of its picture."""
        return [
            (ball_reflector(half.run), partial(half.bands, self.capture_mm, progress))
            for half in self.halves
        ]


def prepared_merge(folder: Path, calibration: Path, exports: Path, options: MergeOptions) -> Merge:
    """Read what a merge needs, but the photographs themselves.

    InputError: one cannot be read, they do not belong together, or nothing was photographed.
    """
    run, export = read_run(folder), read_export(exports)
    check_same_export(folder, run.record, exports)
    parts = run.record.machines
    read = [read_machine(calibration / name / RECORD) for name in parts]
    machines = [
        _halves(run.of_frames(frames), export, calibration, (machine, known), options)
        for frames, machine, (_, known) in zip(parts.values(), tied(read), read, strict=True)
    ]
    halves = tuple(half for one in machines for half in one if _photographed(half))
    if not halves:
        raise InputError(
            f"{folder} has no photograph of the lit object at a stop that {calibration} knows: "
            "photograph the object with tbcad run"
        )
    mirrors = {half.camera_id: len(half.pixels) for half in halves}
    sigmas = ray_sigmas((calibration / name for name in parts), mirrors, export.capture_mm)
    return Merge(halves, export.capture_mm, _facts(export, run, calibration, options), sigmas)


def _halves(
    run: Run,
    export: ExportedDesign,
    calibration: Path,
    calibrated: tuple[Machine, tuple[Frame, ...]],
    options: MergeOptions,
) -> list[HalfMerge]:
    """Photographs of one machine: a prototype for both cameras, a shell's camera for one."""
    machine, frames = calibrated
    record, camera = run.record, machine.camera
    if (record.width_px, record.height_px) != (camera.width_px, camera.height_px):
        raise InputError(
            f"{run.folder} has photographs of {record.width_px} x {record.height_px} pixels, the "
            f"camera of {calibration} {camera.width_px} x {camera.height_px}: calibrate with this "
            "run's camera"
        )
    plan = plan_of(export, run.record.geometry, run.record.frames)
    corrected, exposure = corrections(options, machine.camera), common_exposure(run)
    known, stops = stops_known(plan, frames), range(len(plan.angle))
    of_prototype = run.record.geometry == "prototype"
    screen = upper_screen(export.folder, wider=True) if of_prototype else None
    halves = []
    for half, turn in enumerate(TURNS):
        if (plan.ball[half] == NOT_SERVED).any():
            continue
        of_stop = {f.stop - 1: f for f in run.record.frames if f.object_turn_deg == turn}
        shown = tuple(of_stop.get(stop) if known[half, stop] else None for stop in stops)
        missing = {stop: "the run leaves this stop out" for stop in stops if stop not in of_stop}
        photographs = CorrectedPhotographs(run, shown, corrected, exposure, missing)
        placed = machine_run(export, plan, machine, frames, half)
        pixels = np.zeros(len(placed.stop), dtype=np.int64)
        halves.append(HalfMerge(placed, photographs, pixels, screen))
    return halves


def _photographed(half: HalfMerge) -> bool:
    run, frames = half.photographs.run, half.photographs.frames
    return any(frame is not None and run.exposure(frame, LIT) is not None for frame in frames)


def _facts(
    export: ExportedDesign, run: Run, calibration: Path, options: MergeOptions
) -> dict[str, Any]:
    return {
        "object": f"photographs of {run.folder.name}",
        "design": export.spec.name,
        "n": export.spec.optics.n,
        "geometry": f"photographed {run.record.geometry}",
        "run": str(run.folder),
        "source": run.record.source,
        "camera": run.record.camera,
        "calibration": str(calibration),
        "vignetting": "flat field" if options.flat else options.vignetting,
        "encoding": options.encoding,
        "brightness": options.brightness,
        **({"optics": "real", "real": run.record.real.model_dump()} if run.record.real else {}),
    }


def _shows_object(
    pinhole: Floats, radius: float, mirror: Ints, direction: Floats, distance: Floats
) -> Bools:
    """Where rays (n, 3) on no mirror meet the capture sphere: in front of mirrors it never is."""
    del distance
    origin = np.broadcast_to(pinhole, direction.shape).copy()
    return np.asarray((mirror == 0) & meets_sphere(origin, direction, radius))


def write_merge(folder: Path, merge: Merge, progress: Progress) -> dict[str, Any]:
    """Merge and write all files into the caller's folder, and return its record."""
    record = capture_record(merge.facts)
    stored = {**record, RAY_SIGMAS: merge.ray_sigma_mm}  # which would fill capture.json
    write_cameras(folder, merge.cameras(progress), merge.capture_mm, stored)
    record["based_on"] = {half.camera_id: based_on(half) for half in merge.halves}
    write_record(folder, record)
    return record


def based_on(half: HalfMerge) -> dict[str, Any]:
    """Sources of a camera's picture after its merge, for capture.json."""
    missing = half.missing_mirrors()
    run, known = half.photographs.run, [f for f in half.photographs.frames if f is not None]
    phases = LIT, half.photographs.dark_phase
    names = {exposure_name(frame, phase) for frame in known for phase in phases}
    unread = {
        exposure_name(frame, LIT): half.photographs.missing[stop]
        for stop, frame in enumerate(half.photographs.frames)
        if frame is not None and stop in half.photographs.missing
    }
    return {
        "mirrors": len(half.pixels),
        "mirrors_with_rays": int((half.pixels > 0).sum()),
        "stops": len(half.photographs.frames),
        "stops_used": len(known) - len(unread),
        "mirrors_missing": {
            reason: [f"{half.camera_id}{number:04d}" for number in numbers]
            for reason, numbers in missing.items()
        },
        "photographs_not_used": {name: fault for name, fault in run.faults.items() if name in names}
        | unread,
        "without_dark": sorted(half.photographs.without_dark),
    }
