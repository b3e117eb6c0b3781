"""The folder of a calibration."""

import textwrap
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.common.figure_files import PlotFormat, figure_file
from tbcad.common.results import csv_text
from tbcad.common.screen import WIDTH
from tbcad.core.geometry.vectors import norm
from tbcad.output.manifest import write_manifest
from tbcad.records.calibration import NAME as RECORD
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.estimate.parameters import covariance
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
from tbcad.rig.calibration.report.verdict import CalibrationVerdict
from tbcad.rig.machine.machine import RECORD as MACHINE
from tbcad.rig.machine.machine import Machine, write_machine

COVARIANCE = "covariance.npz"


def write_calibration(
    folder: Path,
    result: MachineCalibration,
    judged: CalibrationVerdict,
    basis: dict[str, Any],
    plot: PlotFormat = "png",
) -> dict[str, Any]:
    """Write all files of a calibration into the caller's folder, and return its record."""
    known = covariance(result.found.prior, result.found.information)
    record = calibration_record(result, judged, known, basis)
    write_machine(folder / MACHINE, result.found.machine, result.setup.frames)
    record.write(folder / RECORD)
    tables = (
        spheres_table(result, known),
        angles_table(result, known),
        rays_table(result),
        residuals_table(result),
    )
    for table in tables:
        (folder / f"{table.name}.csv").write_text(csv_text(table), encoding="utf-8")
    (folder / COVARIANCE).write_bytes(covariance_bytes(result, known))
    for name, data in plots(result, sphere_covariances(result, known), plot).items():
        (folder / name).write_bytes(data)
    write_manifest(folder, "calibration")
    return record.document()


def write_recovered(
    folder: Path, result: MachineCalibration, truth: Machine, plot: PlotFormat = "png"
) -> str:
    """Write recovered.csv and its plot of a simulated run, and return what they say."""
    kinds = recovered_errors(
        result, covariance(result.found.prior, result.found.information), truth
    )
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
    errors = ray_errors(result.found, truth, known.frame, known.sphere)
    found = [
        f"{np.median(place_mm(one)):.3f} mm, {np.median(turn_mrad(one)):.2f} mrad"
        for one in (errors.relative, errors.in_run)
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
                f"true errors of the centres, besides a motion and growth of all: "
                f"{np.median(off):.1f} um (median), {off.max():.1f} um (largest)"
            )
    return "\n".join(textwrap.fill(line, WIDTH, subsequent_indent="  ") for line in lines)
