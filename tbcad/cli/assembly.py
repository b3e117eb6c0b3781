"""The command that writes the assembly page."""

import json as json_text
from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.options.checks import check_is_folder
from tbcad.options.shared import Exports, ForceFile, Out


@app.command()
def assembly(
    folder: Exports[Path],
    out: Out[Path] = Path("assembly"),
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="Draw a picture for each step.")
    ] = True,
    json: Annotated[
        bool, typer.Option("--json", help="Print the steps as JSON and write nothing.")
    ] = False,
    force: ForceFile = False,
) -> int:
    """Write assembly.html: how an export's prototype is assembled, step by step, with pictures.

    Each step names its parts by their numbers in the list, torque or fit, and what to check. Exit
    code 0, or 2 for bad input.
    """
    from tbcad.prototype.assembly_steps.machine import read_machine
    from tbcad.prototype.assembly_steps.steps import assembly_steps, record
    from tbcad.report.assembly_page import write_page

    check_is_folder(folder)
    machine = read_machine(folder)
    steps = assembly_steps(machine)
    if json:
        typer.echo(json_text.dumps({"steps": record(steps)}, indent=1))
        return 0
    file = write_page(folder, out, machine, steps, pictures=pictures, force=force)
    typer.echo(f"{file}: {len(steps)} steps, {sum(machine.quantities.values())} parts")
    return 0
