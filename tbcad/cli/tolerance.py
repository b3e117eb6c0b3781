"""How exact a machine must be made: heavy libraries are imported inside the command."""

from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.options import ObjectFile, Scheduler
from tbcad.screen import stages


@app.command()
def tolerance(
    folder: Annotated[Path, typer.Argument(help="Folder written by tbcad build.")],
    process: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="How it is made: fdm, sls, sla, cnc, diamond, or a TOML file.",
        ),
    ] = "sla",
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KIND=VALUE", help="Change any error of the process; repeatable."
        ),
    ] = None,
    machines: Annotated[int, typer.Option(help="Number of machines that are made.")] = 1000,
    wanted: Annotated[
        float, typer.Option("--yield", help="Share of the machines that is to be good.")
    ] = 0.99,
    seed: Annotated[int, typer.Option(help="Of all machines.")] = 1,
    calibrated_mrad: Annotated[
        float, typer.Option(help="What a calibration leaves of each mirror's direction.")
    ] = 0.5,
    object_file: ObjectFile = None,
    scheduler: Scheduler = None,
    out: Annotated[
        Path, typer.Option(help="Folder for the files; others in it are left as they are.")
    ] = Path("tolerance"),
) -> int:
    """Make thousands of machines as they might come out: how many see enough, and what hurts most.

    Writes tolerance.json, tables, notes and plots.
    """
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.object import chosen
    from tbcad.simulate.study.record import check_target, write
    from tbcad.tolerance.analysis import Options, analyse
    from tbcad.tolerance.process.process import load_process
    from tbcad.tolerance.report import json_text, study, summary_text

    wishes = Options(machines, seed, wanted, calibrated_mrad / 1000, scheduler).checked()
    made_by = load_process(process, list(settings or []))
    check_target(out)
    with stages(6) as told:
        told.stage("record of the export")
        export = read_export(folder)
        subject = chosen(object_file, export.capture_mm)
        found = analyse(export, made_by, subject, wishes, told.stage, told.detail)
        files = write(study(found), out, {"tolerance.json": json_text(found).encode()})
    typer.echo(summary_text(found))
    typer.echo(f"{out}: {', '.join(file.name for file in files)}")
    return 0
