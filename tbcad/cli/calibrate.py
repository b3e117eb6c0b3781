"""Calibrate the built prototype, and the lens of its camera."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.early_checks import check_is_export, check_is_run
from tbcad.cli.options import (
    Force,
    ForceFile,
    JsonResult,
    OutReplaced,
    PlotFormatOption,
    RunFolder,
)
from tbcad.cli.output_mode import print_json
from tbcad.errors import InputError
from tbcad.screen import paragraph, stages

if TYPE_CHECKING:
    from tbcad.calibration.intrinsics.checkerboard import SolvedLens

FAILED = 1  # exit code of a calibration that is not good enough


@app.command()
def calibrate(
    run: RunFolder,
    exports: Annotated[
        Path, typer.Option("--exports", metavar="FOLDER", help="Folder written by tbcad build.")
    ] = Path("exports"),
    out: OutReplaced = Path("calibration"),
    process: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How the prototype is made: fdm, sls, sla, cnc, diamond, or a TOML file. By "
            "default fdm.",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KIND=VALUE", help="Change any error of the process; repeatable."
        ),
    ] = None,
    measured: Annotated[
        list[str] | None,
        typer.Option(
            metavar="BALL=MM",
            help="Measured radius of a ball or cap, 1=43.21, with its standard deviation in mm "
            "1=43.21:0.005, by default 0.01 mm; repeatable.",
        ),
    ] = None,
    intrinsics: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Lens of the camera as OpenCV (YAML, XML), mrcal (.cameramodel), COLMAP "
            "(cameras.txt) or tbcad intrinsics wrote it. By default the lens is estimated too.",
        ),
    ] = None,
    plot: PlotFormatOption = "png",
    force: Force = False,
    json: JsonResult = False,
) -> int:
    """Find the machine that took the photographs of a run, and how well its rays are known.

    Writes machine.json, calibration.json, tables of spheres, angles, rays and residuals, the
    covariance and plots. Exits with 1 where the calibration is not good enough.
    """
    check_is_run(run)
    check_is_export(exports)
    if intrinsics is not None and not intrinsics.is_file():
        raise InputError(f"{intrinsics}: no such file; give the one that `tbcad intrinsics` wrote")
    from tbcad.api import calibrate as calibrated
    from tbcad.calibration.options import CalibrationOptions
    from tbcad.tolerance.process.process import load_process

    options = CalibrationOptions(
        process, tuple(settings or ()), tuple(measured or ()), intrinsics, plot
    )
    if process is not None:
        load_process(process, options.settings)
    with stages(4) as screen:
        written = calibrated(
            run,
            exports,
            options,
            out=out,
            force=force,
            progress=screen.stage,
            detail=screen.detail,
        )
    if json:
        found = [{"folder": str(one.folder), **one.record} for one in written.every]
        print_json({"schema": "tbcad-calibrations/1", "calibrations": found})
    for one in written.every if not json else ():
        typer.echo(one.text)
        typer.echo(f"process: {options.process_words}; files: {one.folder}")
    return FAILED if any(one.verdict.answer == "not good" for one in written.every) else 0


@app.command()
def intrinsics(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Photographs of a board, one camera.")
    ],
    squares: Annotated[
        str, typer.Option(metavar="WxH", help="Squares of the board, columns x rows.")
    ] = "9x6",
    size: Annotated[float, typer.Option(min=0.1, max=1000, help="Width of a square, mm.")] = 5.0,
    charuco: Annotated[
        str | None,
        typer.Option(metavar="DICTIONARY", help="Markers of a ChArUco board, for instance 4x4_50."),
    ] = None,
    marker: Annotated[
        float | None, typer.Option(metavar="MM", help="Width of a ChArUco board's markers, mm.")
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="File to write, YAML as OpenCV writes it.")
    ] = Path("camera.yml"),
    force: ForceFile = False,
    json: JsonResult = False,
) -> int:
    """Solve the lens of a camera from photographs of a checkerboard or ChArUco board.

    Boards may be partly out of the picture. Writes focal lengths, principal point and distortion
    with their standard deviations, for tbcad calibrate --intrinsics.
    """
    from tbcad.calibration.intrinsics.boards import parse_squares
    from tbcad.calibration.intrinsics.checkerboard import EDGE_SHARE

    columns, rows = parse_squares(squares)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; name one with photographs of a board")
    if out.exists() and not force:
        raise InputError(f"{out} exists: choose another name, or replace it with --force")
    from tbcad.api import solve_intrinsics

    with stages(1) as screen:
        screen.stage("corners of boards")
        solved = solve_intrinsics(
            folder,
            (columns, rows),
            size,
            charuco=charuco,
            marker_mm=marker,
            out=out,
            detail=screen.detail,
        )
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
