"""The command `tbcad`: thin; heavy libraries are imported inside the commands."""

from tbcad.app.cli import memory as _memory  # noqa: F401, I001 - first of all

import gc
import os
import sys
import warnings
from collections.abc import Callable
from functools import partial

import typer

from tbcad.app.cli.commands import build as _build  # noqa: F401 - adds its commands
from tbcad.app.cli.commands import captures as _captures  # noqa: F401 - adds its commands
from tbcad.app.cli.commands import designs as _designs  # noqa: F401 - adds its commands
from tbcad.app.cli.commands import explain as _explain  # noqa: F401 - adds its command
from tbcad.app.cli.commands import machines as _machines  # noqa: F401 - adds its commands
from tbcad.app.cli.commands import refocus as _refocus  # noqa: F401 - adds its command
from tbcad.app.cli.commands import show as _show_command  # noqa: F401 - adds its command
from tbcad.app.cli.commands import study as _study  # noqa: F401 - adds its commands
from tbcad.app.cli.commands import view as _view  # noqa: F401 - adds its command
from tbcad.app.cli.commands import workshop as _workshop  # noqa: F401 - adds its commands
from tbcad.app.cli.app import app
from tbcad.app.cli.help_texts import add_examples, order_help
from tbcad.app.cli.endings import (
    INTERRUPTED,
    Stopped,
    check_is_not_renamed,
    shortage,
    signals_as_interrupt,
    usage_error_text,
)
from tbcad.errors import InputError, PlausibilityWarning

order_help(app)
add_examples(app)


def run(arguments: list[str]) -> int:
    """Run one command and return its exit code; bad input is told in one line on stderr."""
    with warnings.catch_warnings(), signals_as_interrupt():
        warnings.simplefilter("always", PlausibilityWarning)
        warnings.showwarning = partial(_show_warning, warnings.showwarning)
        return _run(arguments)


def _show_warning(
    others: Callable[..., None], message: Warning | str, category: type[Warning], *where: object
) -> None:
    """Show a warning of ours in one line; Python shows others with their place in the code."""
    if issubclass(category, PlausibilityWarning):
        sys.stderr.write(f"tbcad: warning: {message}\n")
    else:
        others(message, category, *where)


def _run(arguments: list[str]) -> int:
    try:
        check_is_not_renamed(arguments)
        code = int(app(arguments, prog_name="tbcad", standalone_mode=False) or 0)
    except typer.Exit as stop:
        return stop.exit_code
    except (InputError, typer.TyperException) as error:
        text = str(error) if isinstance(error, InputError) else usage_error_text(error)
        sys.stderr.write(f"tbcad: {text}\n")
        return 2
    except Stopped as stop:
        sys.stderr.write(f"tbcad: stopped; {stop}\n")
        return INTERRUPTED
    except (MemoryError, OSError, RuntimeError) as error:
        reason = shortage(error)
        if reason is None:
            raise
        sys.stderr.write(f"tbcad: {reason}\n")
        return 2
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    if code == INTERRUPTED:  # as typer returns it, too
        sys.stderr.write("tbcad: stopped; nothing was changed\n")
    return code


def main() -> None:
    """Entry point of the command."""
    # None of them concerns a design, and looking for them in all installed packages takes time.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # Both cores are at work; threads of the linear algebra would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    code = run(sys.argv[1:])
    gc.freeze()  # at its end Python looks for no garbage among what the libraries brought
    sys.exit(code)
