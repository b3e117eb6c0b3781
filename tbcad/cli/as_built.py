"""Write a calibrated prototype as it was built."""

from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.early_checks import check_is_calibration, check_is_export
from tbcad.cli.options import ExportsOption, Force, JsonResult, OutReplaced
from tbcad.cli.output_mode import print_json
from tbcad.screen import stages


@app.command(name="as-built")
def as_built(
    calibration: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder written by tbcad calibrate.")
    ],
    exports: ExportsOption = None,
    out: OutReplaced = Path("asbuilt"),
    force: Force = False,
    json: JsonResult = False,
) -> int:
    """Write the measured spheres of a calibrated prototype as exact, coloured solids (STEP).

    The colour says how far a ball's centre is off, in micrometres; legend.png and deviations.csv
    give the scale and all figures.
    """
    check_is_calibration(calibration)
    if exports is not None:
        check_is_export(exports)
    from tbcad.api import as_built as written

    with stages(1) as screen:
        record = written(calibration, exports, out=out, force=force, progress=screen.stage)
    if json:
        print_json(record)
        return 0
    typer.echo(
        f"{record['balls']} balls: centres off by {record['median_um']:.0f} micrometres (median), "
        f"{record['largest_um']:.0f} at most"
    )
    typer.echo(f"{out}: as_built.step, deviations.csv, legend.png, as_built.json")
    return 0
