"""How exactly parts must be made: heavy libraries are imported inside the command."""

from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.errors import InputError
from tbcad.options.checks import check_is_calibration, check_is_export, check_is_object
from tbcad.options.shared import (
    Exports,
    JsonResult,
    ObjectFile,
    Out,
    PlotFormatOption,
    Scheduler,
    UnitOption,
    UpOption,
)
from tbcad.screen import paragraph, stages


@app.command()
def tolerance(
    folder: Exports[Path],
    process: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How it is made: fdm, sls, sla, cnc, diamond, or a TOML file. By default sla, and "
            "the yields of all of them are compared.",
        ),
    ] = None,
    margins: Annotated[
        bool,
        typer.Option(
            "--margins",
            help="Also search for the minimum margin on the coverage with which each process "
            "reaches the yield, as tbcad build --for-process does; some 10 s a process.",
        ),
    ] = False,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KIND=VALUE", help="Change any error of the process; repeatable."
        ),
    ] = None,
    builds: Annotated[int, typer.Option(help="Number of simulated builds.")] = 1000,
    share: Annotated[
        float,
        typer.Option("--yield", help="Share of the simulated builds that must reach the target."),
    ] = 0.99,
    seed: Annotated[int, typer.Option(help="Seed of all random errors.")] = 1,
    calibrated_mrad: Annotated[
        float, typer.Option(help="Error of each mirror's direction after calibration, mrad.")
    ] = 0.5,
    as_built: Annotated[
        Path | None,
        typer.Option(
            "--as-built",
            metavar="CALIBRATION",
            help="Instead of a process: this very prototype, with what its calibration (a folder "
            "that tbcad calibrate wrote) leaves unknown.",
        ),
    ] = None,
    object_file: ObjectFile[Path] = None,
    up: UpOption = None,
    unit: UnitOption = None,
    scheduler: Scheduler = None,
    out: Out[Path] = Path("tolerance"),
    json: JsonResult = False,
    plot: PlotFormatOption = "png",
) -> int:
    """Simulate many builds with random errors: how many reach the target, and what limits them.

    Writes tolerance.json, which --json prints too, tables, notes and plots.
    """
    from tbcad.output.single_files import check_tables

    check_tables(out)
    if as_built is not None:
        if process or margins or settings:
            raise InputError(
                "--as-built is about no process: leave out --process, --margins and --set"
            )
        return _as_built(folder, as_built, builds, seed, out, json)
    from tbcad.tolerancing.options import ToleranceOptions
    from tbcad.tolerancing.process.process import DEFAULT_PROCESS, load_process

    changes = list(settings or [])
    load_process(process or DEFAULT_PROCESS, changes)  # or refuse it
    options = ToleranceOptions(
        builds, seed, share, calibrated_mrad / 1000, scheduler, margins=margins
    )
    check_is_export(folder)
    check_is_object(object_file, up, unit)  # as all before, before heavy libraries are loaded
    from tbcad.api import analyse
    from tbcad.results.study import check_study_folder, write_study
    from tbcad.tolerancing.report import json_text, summary_text, tolerance_study
    from tbcad.tolerancing.stages import TABLES

    check_study_folder(out)
    with stages(6 + (process is None) + margins) as screen:
        analysis = analyse(
            folder,
            process,
            object_file,
            up=up,
            unit=unit,
            settings=changes,
            options=options,
            progress=screen.stage,
            detail=screen.detail,
            answer=screen.note,
        )
        screen.stage(TABLES)
        more = {"tolerance.json": json_text(analysis).encode()}
        files = write_study(tolerance_study(analysis), out, more, plot)
    if json:
        typer.echo(json_text(analysis), nl=False)
        return 0
    typer.echo(paragraph(summary_text(analysis)))
    typer.echo(paragraph(f"{out}: {', '.join(file.name for file in files)}"))
    return 0


def _as_built(
    folder: Path, calibration: Path, builds: int, seed: int, out: Path, json: bool
) -> int:
    if builds < 1:
        raise InputError(f"--builds {builds} is too few: allowed is 1 or more")
    check_is_export(folder)
    check_is_calibration(calibration)
    from json import dumps

    from tbcad.atomic_files import replace_files
    from tbcad.calibrated_solids.tolerance import (
        as_built_tolerance,
        summary,
        tolerance_record,
        tolerance_table,
    )
    from tbcad.results.study import check_study_folder
    from tbcad.results.tables import csv_text

    check_study_folder(out)
    with stages(1) as screen:
        screen.stage("coverage and rays as calibrated")
        found = as_built_tolerance(calibration, folder, builds, seed)
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
