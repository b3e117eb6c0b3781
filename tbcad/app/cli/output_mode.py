"""How much of a result a command prints: options that exclude each other."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.errors import InputError

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

Full = Annotated[bool, typer.Option("--full", help="Print every check before the summary.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print the verdict only.")]
Json = Annotated[bool, typer.Option("--json", help="Print the summary as JSON; see verify/README.")]


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
