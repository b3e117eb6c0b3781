"""The command `tbcad` itself: the modules beside this one add its subcommands, and print by it."""

from collections.abc import Callable, Iterable
from inspect import Signature
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from tbcad.errors import InputError
from tbcad.options.call import parameters, tell_options
from tbcad.version import __version__

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

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
Full = Annotated[bool, typer.Option("--full")]
"""Print every check before the summary."""
Quiet = Annotated[bool, typer.Option("--quiet", "-q")]
"""Print the verdict only."""
Json = Annotated[bool, typer.Option("--json")]
"""Print the summary as JSON; see verify/README."""


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


def output_mode(full: bool, quiet: bool, json: bool) -> "Output":
    """What is to be printed; more than one thing is refused."""
    asked: dict[Output, bool] = {"full": full, "quiet": quiet, "json": json}
    chosen = [name for name, wanted in asked.items() if wanted]
    if len(chosen) > 1:
        given = " and ".join(f"--{name}" for name in chosen)
        raise InputError(f"{given} exclude each other: give only one of them")
    return chosen[0] if chosen else "summary"


def print_result(record: object, lines: Iterable[str], json: bool) -> None:
    """Print what was found, for other programs or in words."""
    if json:
        print_json(record)
        return
    for line in lines:
        typer.echo(line)


def print_json(record: object) -> None:
    """Print a record for other programs."""
    import json

    typer.echo(json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False))


tell_options(__name__)
