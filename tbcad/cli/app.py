"""The command `tbcad` itself: the modules beside this one add its subcommands."""

from typing import Annotated

import typer

from tbcad.version import __version__

app = typer.Typer(
    name="tbcad",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Mirror arrays for light-field cameras: from the optical design to parts that can be "
    "made, verified on the files written. Start with **tbcad build --out exports**.",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tbcad {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    del version
