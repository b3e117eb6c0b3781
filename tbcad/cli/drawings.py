"""The command that draws an export's parts: heavy libraries are imported inside the command."""

import json as json_text
from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.options.checks import check_is_export
from tbcad.options.shared import Exports, ForceFile, Out
from tbcad.screen import stages


@app.command()
def drawings(
    folder: Exports[Path],
    out: Out[Path] = Path("drawings"),
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="PART",
            help="Draw this only, such as bearing_head or optical_layout; repeatable. By default "
            "everything.",
        ),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print what was written as JSON, without progress.")
    ] = False,
    force: ForceFile = False,
) -> int:
    """Draw an export for the workshop: sheets as PDF to scale and as DXF at full size.

    A sheet for each printed part with views, sizes and a table of its holes; the assembly with
    call-outs by number of the parts list; sections of the shells; the optical layout. Exit code 0,
    or 2 for bad input.
    """
    check_is_export(folder)
    from tbcad.drawings.write import record, write_drawings
    from tbcad.schedule import cores

    with stages(0, silent=json) as screen:
        written = write_drawings(
            folder,
            out,
            only or (),
            force=force,
            progress=lambda name: screen.stage(f"drew {name}"),
            workers=cores(),
        )
    if json:
        typer.echo(json_text.dumps(record(out, written), indent=1))
    else:
        typer.echo(f"{out}: {len(written)} sheets, each as PDF and DXF")
    return 0
