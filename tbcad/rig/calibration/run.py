"""`tbcad calibrate`: from a run's folder to the folder of its calibration."""

import textwrap
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.common.atomic_files import InFolder
from tbcad.common.figure_files import PlotFormat, figure_file
from tbcad.common.results import csv_text
from tbcad.common.screen import WIDTH
from tbcad.core.geometry.vectors import norm
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.options.machines import CalibrateOptions
from tbcad.output.folder import check_replaceable, replacing
from tbcad.output.manifest import write_manifest
from tbcad.output.single_files import files_named
from tbcad.records.calibration import NAME as RECORD
from tbcad.rig.calibration.calibrate import MachineCalibration, Setup, calibrate, prepared_setup
from tbcad.rig.calibration.detection.detect import detect
from tbcad.rig.calibration.detection.matching import object_room
from tbcad.rig.calibration.intrinsics.files import read_lens
from tbcad.rig.calibration.priors import parse_measured
from tbcad.rig.calibration.report.plots import INCHES, draw_recovered, plots
from tbcad.rig.calibration.report.record import (
    angles_table,
    calibration_record,
    covariance_bytes,
    rays_table,
    residuals_table,
    sphere_covariances,
    spheres_table,
)
from tbcad.rig.calibration.report.recovered import (
    BESIDES,
    Kind,
    place_mm,
    ray_errors,
    recovered_errors,
    recovered_table,
    turn_mrad,
)
from tbcad.rig.calibration.report.verdict import CalibrationVerdict, verdict, verdict_text
from tbcad.rig.machine.designed import dome_radius
from tbcad.rig.machine.machine import RECORD as MACHINE
from tbcad.rig.machine.machine import TRUTH, Machine, read_machine, write_machine
from tbcad.rig.runs import Run, check_same_export, read_run
from tbcad.tolerancing.process.process import Process, load_process, process_errors

DEFAULT_PROCESS = "fdm"  # a prototype is printed; its design does not say how
SIMULATED = "simulated"  # source of a run that tbcad simulate-run wrote
COVARIANCE = "covariance.npz"


@dataclass(frozen=True)
class WrittenCalibration(InFolder):
    """A calibration whose files are written."""

    folder: Path
    result: MachineCalibration
    verdict: CalibrationVerdict
    text: str
    record: dict[str, Any]
    others: tuple["WrittenCalibration", ...] = ()  # of a shell's other camera

    def __fspath__(self) -> str:
        return str(self.folder.parent if self.others else self.folder)

    @property
    def every(self) -> tuple["WrittenCalibration", ...]:
        """This one and the others."""
        return (self, *self.others)


def calibrate_run(options: CalibrateOptions) -> WrittenCalibration:
    """Calibrate the machines that took a run's photographs, and write all that is found.

    A prototype's files are in `options.out`, those of a shell's cameras in its folders a and b.

    InputError: one cannot be read, they do not belong together, there is nothing to calibrate from,
    or out cannot be replaced.
    """
    folder, exports, out = Path(options.run), Path(options.exports), Path(options.out)
    progress, detail = options.progress, options.detail
    progress("run and build")
    process = load_process(
        DEFAULT_PROCESS if options.process is None else options.process, options.settings
    )
    run = read_run(folder)
    check_same_export(folder, run.record, exports)
    machines = {name: run.of_frames(frames) for name, frames in run.record.machines.items()}
    inputs = (folder, exports, options.intrinsics, *files_named(options.process))
    for name in machines:
        check_replaceable(out / name, "calibration", options.force, inputs)
    export = read_export(exports)
    lens = None if options.intrinsics is None else read_lens(Path(options.intrinsics))
    size = run.record.width_px, run.record.height_px
    setups = [
        prepared_setup(export, one.record.frames, size, lens, run.record.geometry)
        for one in machines.values()
    ]
    truths = [_truth(one, setup) for one, setup in zip(machines.values(), setups, strict=True)]
    found = []
    for one, setup in zip(machines.values(), setups, strict=True):
        progress("highlights in photographs")
        measured = parse_measured(tuple(options.measured), len(setup.plan))
        prior = setup.prior(process_errors(process, caps=export.spec.prototype.caps), measured)
        detection = detect(one, prior, object_room(export), dome_radius(export), detail)
        progress("machine and its uncertainty")
        found.append(calibrate(setup, detection, prior, detail))
    progress("files")
    written = []
    for (name, one), result, truth in zip(machines.items(), found, truths, strict=True):
        judged, basis = verdict(result), _basis(one, result.setup, options, process)
        with replacing(out / name, "calibration", options.force, inputs) as new:
            record = write_calibration(new, result, judged, basis, options.plot)
            text = verdict_text(result, judged)
            if truth is not None:
                text += "\n" + write_recovered(new, result, truth, options.plot)
        written.append(WrittenCalibration(out / name, result, judged, text, record))
    first, *others = written
    return replace(first, others=tuple(others))


def _truth(run: Run, setup: Setup) -> Machine | None:
    """The machine of a simulated run; None of a real one, and where its file was taken away."""
    if run.record.geometry == "shell":
        return None  # its calibration is in the frame of the shell, its truth in the design's
    path = run.folder / TRUTH
    if run.record.source != SIMULATED or not path.is_file():
        return None
    truth, frames = read_machine(path)
    shapes = [(len(one.radius), len(one.leds)) for one in (truth, setup.designed)]
    if frames != run.record.frames or shapes[0] != shapes[1]:
        raise InputError(
            f"{path} is of another run: simulate the run again, or remove the file, which only "
            "serves to compare"
        )
    return truth


def _basis(run: Run, setup: Setup, options: CalibrateOptions, process: Process) -> dict[str, Any]:
    """Basis of the calibration, for its record."""
    return {
        "run": str(run.folder.resolve()),
        "exports": str(setup.export.folder.resolve()),
        "export_sha256": run.record.export_sha256,
        "source": run.record.source,
        "geometry": run.record.geometry,
        "camera": run.record.camera,
        "photographs": {
            "expected": len(run.record.frames) * len(run.record.phases),
            "usable": len(run.exposures),
        },
        "process": {
            "name": process.name,
            "title": process.title,
            "given": options.process is not None,
            "settings": list(options.settings),
        },
        "lens": str(options.intrinsics or "estimated"),
        "measured_radii": list(options.measured),
    }


def write_calibration(
    folder: Path,
    result: MachineCalibration,
    judged: CalibrationVerdict,
    basis: dict[str, Any],
    plot: PlotFormat = "svg",
) -> dict[str, Any]:
    """Write all files of a calibration into the caller's folder, and return its record."""
    record = calibration_record(result, judged, basis)
    write_machine(folder / MACHINE, result.found.machine, result.setup.frames)
    record.write(folder / RECORD)
    tables = (
        spheres_table(result),
        angles_table(result),
        rays_table(result),
        residuals_table(result),
    )
    for table in tables:
        (folder / f"{table.name}.csv").write_text(csv_text(table), encoding="utf-8")
    (folder / COVARIANCE).write_bytes(covariance_bytes(result))
    for name, data in plots(result, sphere_covariances(result), plot).items():
        (folder / name).write_bytes(data)
    write_manifest(folder, "calibration")
    return record.document()


def write_recovered(
    folder: Path, result: MachineCalibration, truth: Machine, plot: PlotFormat = "svg"
) -> str:
    """Write recovered.csv and its plot of a simulated run, and return what they say."""
    kinds = recovered_errors(result, truth)
    table = recovered_table(kinds)
    (folder / f"{table.name}.csv").write_text(csv_text(table), encoding="utf-8")
    drawn = figure_file(lambda figure: draw_recovered(figure, kinds), INCHES, plot)
    (folder / f"recovered.{plot}").write_bytes(drawn)
    write_manifest(folder, "calibration")
    return _recovered_text(result, truth, kinds, plot)


def _recovered_text(
    result: MachineCalibration, truth: Machine, kinds: tuple[Kind, ...], plot: PlotFormat
) -> str:
    figures = sum(len(kind.sigma) for kind in kinds)
    within = sum(kind.within * len(kind.sigma) for kind in kinds) / figures
    known = result.rays.known
    found = [
        f"{np.median(place_mm(one)):.3f} mm, {np.median(turn_mrad(one)):.2f} mrad"
        for one in ray_errors(result.found, truth, known.frame, known.sphere)
    ]
    lines = [
        f"of {figures} errors that were simulated, {within:.0%} are recovered to two standard "
        f"deviations or better: recovered.csv, recovered.{plot}",
        f"true errors of the rays: {found[0]} (median); among those of one run {found[1]}",
    ]
    for kind in kinds:
        if kind.name == BESIDES:
            off = norm((kind.recovered - kind.injected).reshape(-1, 3))
            lines.append(
                f"true errors of the centres after similarity alignment: "
                f"{np.median(off):.1f} um (median), {off.max():.1f} um (largest)"
            )
    return "\n".join(textwrap.fill(line, WIDTH, subsequent_indent="  ") for line in lines)
