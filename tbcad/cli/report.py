"""The command that writes the page of an export."""

from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.options.checks import check_is_capture, check_is_export, check_is_folder
from tbcad.options.shared import Exports
from tbcad.screen import stages


@app.command()
def report(
    folder: Exports[Path],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", help="HTML file to write; by default report.html in the folder."
        ),
    ] = None,
    capture: Annotated[
        Path | None,
        typer.Option(
            "--capture",
            metavar="FOLDER",
            help="Folder written by tbcad capture or merge for this export: shows the photograph "
            "in each mirror.",
        ),
    ] = None,
    force: Annotated[
        bool,
        typer.Option(
            "--force", help="Replace a file that tbcad did not write, instead of refusing."
        ),
    ] = False,
) -> int:
    """Write report.html: verdict, 3D view, map of the virtual cameras, tables, pictures.

    One file that opens from disk in any browser, without a network. tbcad build writes it too;
    write it again after a new verification, or to add pictures. Exit code 0, or 2 for bad input.
    """
    check_is_folder(folder)
    check_is_export(folder)
    if capture is not None:
        check_is_capture(capture)
    from tbcad.api import report_page

    with stages(2) as screen:
        file = report_page(
            folder, out, capture=capture, force=force, progress=screen.stage, detail=screen.detail
        )
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")
    return 0
