"""The command that writes a design to begin with."""

import json as json_text
from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.errors import InputError
from tbcad.options.shared import ForceFile

PAPER = "turtleback"


@app.command()
def init(
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="Design file (TOML) to write.")
    ] = None,
    design: Annotated[
        str,
        typer.Option(
            "--from", metavar="NAME", help="Design that comes with tbcad to begin from: see --list."
        ),
    ] = PAPER,
    show: Annotated[
        bool, typer.Option("--list", help="Only list the designs that come with tbcad.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="With --list: print it as JSON.")] = False,
    force: ForceFile = False,
) -> int:
    """Write a design to change: every key with its meaning, unit, default and allowed values.

    Keys that are comments have their defaults, so the file as written is the design it begins from.
    """
    from tbcad.spec.load import shipped_designs

    if show:
        typer.echo(_list(json))
        return 0
    if json:
        raise InputError("--json is about --list: leave it out, or add --list")
    if file is None:
        raise InputError("FILE is missing: name the design to write, such as tbcad init my.toml")
    if design not in shipped_designs():
        known = ", ".join(shipped_designs())
        raise InputError(f"--from is {design!r}, allowed is one of {known}: change it")
    from tbcad.atomic_files import replace_files
    from tbcad.output.single_files import check_file

    check_file(file, force)
    from tbcad.reference.template import design_template

    replace_files(file.parent, {file.name: design_template(design).encode()})
    typer.echo(f"{file}: written; build it by tbcad build {file}")
    return 0


def _list(json: bool) -> str:
    """The designs that come with tbcad, with the first paragraph that each says of itself."""
    from tbcad.spec.files import read_text
    from tbcad.spec.load import shipped_designs

    about = {}
    for name, file in shipped_designs().items():
        lines = read_text(file, name, "design").partition("\n#\n")[0].splitlines()
        about[name] = " ".join(line.strip("# ") for line in lines)
    if json:
        return json_text.dumps({"schema": "tbcad-designs/1", "designs": about}, indent=1)
    from tbcad.screen import paragraph

    return "\n".join(paragraph(f"{name}: {text}") for name, text in about.items())
