"""The command `tbcad`: thin; heavy libraries are imported inside the commands."""

import sys

import typer

from tbcad.cli import build as _build  # noqa: F401 - adds its commands
from tbcad.cli import simulate as _simulate  # noqa: F401 - adds its commands
from tbcad.cli import study as _study  # noqa: F401 - adds its commands
from tbcad.cli import tolerance as _tolerance  # noqa: F401 - adds its command
from tbcad.cli.app import app
from tbcad.errors import InputError


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code; bad input is told in one line on stderr."""
    try:
        return int(app(arguments, standalone_mode=False) or 0)
    except typer.Exit as stop:
        return stop.exit_code
    except (InputError, typer.TyperException) as error:
        text = error.format_message() if isinstance(error, typer.TyperException) else str(error)
        sys.stderr.write(f"tbcad: {text}\n")
        return 2
    except (KeyboardInterrupt, typer.Abort):
        sys.stderr.write("tbcad: stopped; nothing was changed\n")
        return 130


def main() -> None:
    """Entry point of the command."""
    sys.exit(run(sys.argv[1:]))
