"""The command `tbcad` itself: the modules beside this one add its subcommands."""

from collections.abc import Callable
from inspect import Signature
from typing import Annotated, Any, TypeVar

import typer

from tbcad.options.call import parameters
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


Told = TypeVar("Told", bound=Callable[..., int])


def command(name: str | None = None) -> Callable[[Told], Told]:
    """Add a command whose options are the fields of the record that its function takes first.

    What else the function takes are options of the command line alone.
    """

    def added(function: Told) -> Told:
        shown = list(parameters(function))

        def called(**given: Any) -> int:
            # An option that is left out has the record's default.
            told = {key: value for key, value in given.items() if value is not None}
            record = function.__annotations__["options"]
            own = {key: told.pop(key) for key in function.__annotations__ if key in told}
            return function(record(**told), **own)

        called.__name__, called.__doc__ = function.__name__, function.__doc__
        vars(called)["__signature__"] = Signature(shown)
        # typer would take annotations before those of the signature.
        called.__annotations__ = {}
        app.command(name)(called)
        return function

    return added


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
