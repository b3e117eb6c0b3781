"""Calibrate the built prototype, and the lens of its camera."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from tbcad.cli.app import command
from tbcad.cli.output_mode import print_json
from tbcad.options.machines import CalibrateOptions, IntrinsicsOptions
from tbcad.options.shared import JsonResult
from tbcad.screen import paragraph, stages

if TYPE_CHECKING:
    from tbcad.calibration.intrinsics.checkerboard import SolvedLens

FAILED = 1  # exit code of a calibration that is not good enough


@command()
def calibrate(options: CalibrateOptions, json: JsonResult = False) -> int:
    """Find the machine that took the photographs of a run, and how well its rays are known.

    Writes machine.json, calibration.json, tables of spheres, angles, rays and residuals, the
    covariance and plots. Exits with 1 where the calibration is not good enough.
    """
    from tbcad.api import calibrate as calibrated

    with stages(4) as screen:
        written = calibrated(replace(options, progress=screen.stage, detail=screen.detail))
    if json:
        found = [{"folder": str(one.folder), **one.record} for one in written.every]
        print_json({"schema": "tbcad-calibrations/1", "calibrations": found})
    process = options.process or "fdm (the default)"
    for one in written.every if not json else ():
        typer.echo(one.text)
        typer.echo(f"process: {process}; files: {one.folder}")
    return FAILED if any(one.verdict.answer == "not good" for one in written.every) else 0


@command()
def intrinsics(options: IntrinsicsOptions, json: JsonResult = False) -> int:
    """Solve the lens of a camera from photographs of a checkerboard or ChArUco board.

    Boards may be partly out of the picture. Writes focal lengths, principal point and distortion
    with their standard deviations, for tbcad calibrate --intrinsics.
    """
    from tbcad.api import intrinsics as solve_intrinsics
    from tbcad.calibration.intrinsics.checkerboard import EDGE_SHARE

    out = Path(options.out)
    with stages(1) as screen:
        solved = solve_intrinsics(replace(options, progress=screen.stage, detail=screen.detail))
    if json:
        print_json(_lens_record(solved, out))
        return 0
    lens, sigma = solved.lens, solved.sigma
    typer.echo(
        f"{solved.boards} boards, {solved.corners} corners ({solved.outliers} outliers left out), "
        f"RMS {solved.rms_px:.3f} px; focal length {lens.focal[0]:.2f} +- {sigma[0]:.2f} px"
    )
    typer.echo(
        f"principal point {lens.principal[0]:.2f} +- {sigma[2]:.2f}, {lens.principal[1]:.2f} +- "
        f"{sigma[3]:.2f} px; k1 {lens.distortion[0]:.5f} +- {sigma[4]:.5f}"
    )
    if solved.unused:
        typer.echo(paragraph(f"no board found in: {', '.join(solved.unused)}"))
    if solved.reach < EDGE_SHARE:
        typer.echo(
            paragraph(
                f"corners reach {solved.reach:.0%} of the way to the picture's corners: photograph "
                "boards there too, the distortion is not known beyond"
            )
        )
    typer.echo(f"{out}: give it to tbcad calibrate --intrinsics")
    return 0


def _lens_record(solved: "SolvedLens", file: Path) -> dict[str, object]:
    """A solved lens for other programs, lengths in pixels."""
    lens = solved.lens
    figures = {
        name: [float(value) for value in getattr(lens, name)]
        for name in ("focal", "principal", "distortion")
    }
    unused = {"unused": list(solved.unused), "reach": solved.reach, "file": str(file)}
    return {"schema": "tbcad-intrinsics/1", **figures, **solved.facts(), **unused}
