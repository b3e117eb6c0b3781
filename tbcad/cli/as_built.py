"""Write a calibrated prototype as it was built."""

from dataclasses import replace

import typer

from tbcad.cli.app import command
from tbcad.cli.output_mode import print_json
from tbcad.options.machines import AsBuiltOptions
from tbcad.options.shared import JsonResult
from tbcad.screen import stages


@command("as-built")
def as_built(options: AsBuiltOptions, json: JsonResult = False) -> int:
    """Write the measured spheres of a calibrated prototype as exact, coloured solids (STEP).

    The colour says how far a ball's centre is off, in micrometres; legend.png and deviations.csv
    give the scale and all figures.
    """
    from tbcad.api import as_built as written

    with stages(1) as screen:
        record = written(replace(options, progress=screen.stage))
    if json:
        print_json(record)
        return 0
    typer.echo(
        f"{record['balls']} balls: centres off by {record['median_um']:.0f} micrometres (median), "
        f"{record['largest_um']:.0f} at most"
    )
    typer.echo(f"{options.out}: as_built.step, deviations.csv, legend.png, as_built.json")
    return 0
