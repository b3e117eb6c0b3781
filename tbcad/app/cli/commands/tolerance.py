"""How exactly parts must be made: heavy libraries are imported inside the command."""

from pathlib import Path
from typing import Annotated

import typer

from tbcad.app.cli.app import command
from tbcad.common.screen import paragraph, stages
from tbcad.errors import InputError
from tbcad.options.builds import ToleranceOptions
from tbcad.options.checks import check_is_calibration, check_is_export
from tbcad.options.shared import JsonResult, Out, PlotFormatOption


@command()
def tolerance(
    options: ToleranceOptions,
    as_built: Annotated[
        Path | None,
        typer.Option(
            "--as-built",
            metavar="CALIBRATION",
            help="Instead of a process: this very prototype, with what its calibration (a folder "
            "that tbcad calibrate wrote) leaves unknown.",
        ),
    ] = None,
    out: Out[Path] = Path("tolerance"),
    plot: PlotFormatOption = "png",
    json: JsonResult = False,
) -> int:
    """Simulate many builds with random errors: how many reach the target, and what limits them.

    Writes tolerance.json, which --json prints too, tables, notes and plots.
    """
    from tbcad.output.single_files import check_tables

    check_tables(out)
    if as_built is not None:
        if options.process or options.margins or options.settings:
            raise InputError(
                "--as-built is about no process: leave out --process, --margins and --set"
            )
        return _as_built(options, as_built, out, json)
    from tbcad.app.api.verification import checked_process
    from tbcad.app.api.verification import tolerance as analyse

    checked_process(options)  # before heavy libraries are loaded
    from tbcad.common.results import check_study_folder, write_study
    from tbcad.tolerancing.report import json_text, summary_text, tolerance_study
    from tbcad.tolerancing.stages import TABLES

    check_study_folder(out)
    with stages(6 + (options.process is None) + options.margins) as screen:
        analysis = analyse(options.on(screen))
        screen.stage(TABLES)
        more = {"tolerance.json": json_text(analysis).encode()}
        files = write_study(tolerance_study(analysis), out, more, plot)
    if json:
        typer.echo(json_text(analysis), nl=False)
        return 0
    typer.echo(paragraph(summary_text(analysis)))
    typer.echo(paragraph(f"{out}: {', '.join(file.name for file in files)}"))
    return 0


def _as_built(options: ToleranceOptions, calibration: Path, out: Path, json: bool) -> int:
    exports, builds, seed = Path(options.exports), options.builds, options.seed
    check_is_export(exports)
    check_is_calibration(calibration)
    from json import dumps

    from tbcad.common.atomic_files import replace_files
    from tbcad.common.results import check_study_folder, csv_text
    from tbcad.rig.calibrated_solids import (
        as_built_tolerance,
        summary,
        tolerance_record,
        tolerance_table,
    )

    check_study_folder(out)
    with stages(1) as screen:
        screen.stage("coverage and rays as calibrated")
        found = as_built_tolerance(calibration, exports, builds, seed)
    out.mkdir(parents=True, exist_ok=True)
    record = dumps(tolerance_record(found, builds, seed), indent=1) + "\n"
    contents = {
        "as-built.json": record.encode(),
        "as-built.csv": csv_text(tolerance_table(found)).encode(),
    }
    files = replace_files(out, contents)
    if json:
        typer.echo(record, nl=False)
        return 0
    typer.echo(paragraph(summary(found)))
    typer.echo(paragraph(f"{out}: {', '.join(file.name for file in files)}"))
    return 0
