"""Merge the photographs of a run into a light field."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from tbcad.cli.app import app
from tbcad.cli.early_checks import check_is_any_calibration, check_is_export, check_is_run
from tbcad.cli.options import (
    CalibrationFolder,
    ExportsOption,
    Force,
    JsonResult,
    RunFolder,
)
from tbcad.cli.output_mode import print_result
from tbcad.screen import stages

CAPTURES = Path("captures")
FEW_NAMES = 6  # of missing mirrors in a line


@app.command()
def merge(
    run: RunFolder,
    calibration: CalibrationFolder = Path("calibration"),
    exports: ExportsOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="Folder for all files; replaced as a whole or not at all. By default captures/ "
            "with the name of the run, such as captures/first.",
        ),
    ] = None,
    vignetting: Annotated[
        Literal["off", "cos4"],
        typer.Option(
            help="cos4: make good the natural loss of light toward the picture's edge; off: the "
            "photographs are even already."
        ),
    ] = "cos4",
    flat: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Photograph of an even surface, in place of --vignetting; repeatable, the mean "
            "counts.",
        ),
    ] = None,
    encoding: Annotated[
        Literal["linear", "srgb"],
        typer.Option(
            help="linear: numbers of the photographs are proportional to light, as of raw "
            "pictures; srgb: as in a camera's JPEGs."
        ),
    ] = "linear",
    brightness: Annotated[
        float, typer.Option(min=1e-3, max=1e3, help="Factor of the light of all pixels.")
    ] = 1.0,
    force: Force = False,
    json: JsonResult = False,
) -> int:
    """Merge the photographs of a run into the light field that the shell would have given.

    Writes what tbcad capture writes: both pictures at the size of the shell's, and the light field
    with the rays of the calibrated machine, for view, refocus and the studies. Mirrors without a
    usable photograph are left out and named.
    """
    check_is_run(run)
    check_is_any_calibration(calibration)
    if exports is not None:
        check_is_export(exports)
    from tbcad.api import merge as merged
    from tbcad.merged_run.stop_photographs import MergeOptions

    out = out or CAPTURES / run.resolve().name
    options = MergeOptions(vignetting, tuple(flat or ()), encoding, brightness)
    with stages(2) as screen:
        record = merged(
            run,
            calibration,
            exports,
            options,
            out=out,
            force=force,
            progress=screen.stage,
            detail=screen.detail,
        )
    files = f"{out}: the light field as lightfield.h5, pictures, capture.json with all of this"
    print_result(record, [*_lines(record), files], json)
    return 0


def _lines(record: dict[str, Any]) -> list[str]:
    """The verdict first, then each camera, then what is missing and not used."""
    halves = record["based_on"]
    absent = sum(half["mirrors"] - half["mirrors_with_rays"] for half in halves.values())
    mirrors = sum(half["mirrors"] for half in halves.values())
    verdict = "complete" if not absent and len(halves) == 2 else "incomplete"
    lines = [f"{verdict}: {mirrors - absent} of {mirrors} mirrors have rays"]
    if len(halves) == 1:
        lines.append(f"only camera {next(iter(halves))}: the other run was not photographed")
    for camera, half in halves.items():
        counts = record["cameras"][camera]
        lines.append(
            f"camera {camera}: {counts['pixels_on_mirrors']} pixels on "
            f"{half['mirrors_with_rays']} mirrors, "
            f"{counts['pixels_that_see_the_capture_sphere']} see the capture sphere"
        )
        for reason, names in half["mirrors_missing"].items():
            lines.append(f"  {len(names)} missing ({_few(names)}): {reason}")
        unused = half["photographs_not_used"]
        if unused:
            lines.append(f"  {len(unused)} photographs not used: {_few(list(unused))}")
        if half["without_dark"]:
            names = half["without_dark"]
            lines.append(
                f"  {len(names)} without a dark photograph of their exposure: {_few(names)}"
            )
        if half["dark_scaled"]:
            names = half["dark_scaled"]
            lines.append(
                f"  {len(names)} whose dark photograph was exposed otherwise, and is scaled: "
                f"{_few(names)}"
            )
    return lines


def _few(names: list[str]) -> str:
    more = len(names) - FEW_NAMES
    return ", ".join(names[:FEW_NAMES]) + (f" and {more} more" if more > 0 else "")
