"""How commands end: by an interrupt, or by options that are no options."""

import errno
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any, get_args

import typer

from tbcad.errors import InputError, ProcessLost, one_line
from tbcad.options.call import allowed_between, refusal

if TYPE_CHECKING:
    from pydantic import ValidationError


INTERRUPTED = 130  # exit code of a command that is stopped, from the keyboard or by a signal
STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")
DEFAULTS = (signal.SIG_DFL, signal.default_int_handler)
IMPORTING = "<frozen importlib._bootstrap>"  # the code of imports
AGAIN_S = 0.05
USED_UP = (errno.EAGAIN, errno.ENOMEM, errno.ENOSPC)  # processes, memory, room on a disk
NO_THREAD = "can't start new thread"  # Python's own words: it has no class for it


class Stopped(Exception):
    """A command was stopped and has kept something; its text says what, and how to go on."""


def shortage(error: Exception) -> str | None:
    """The resource that the system lacks, as a line for the screen; None: another error."""
    if isinstance(error, MemoryError | ProcessLost) or str(error) == NO_THREAD:
        reason = str(error) or "no memory"
    elif isinstance(error, OSError) and error.errno in USED_UP:
        reason = error.strerror or str(error)
    else:
        return None
    return one_line(
        f"this system has too few resources ({reason}): free memory and disk, allow more processes "
        "(ulimit -u) or ask for a smaller design, and run again"
    )


@contextmanager
def signals_as_interrupt() -> Iterator[None]:
    """Let a kill or a closed terminal raise KeyboardInterrupt during the block.

    A signal that is ignored, as by nohup, stays so; handlers belong to the main thread.
    """
    numbers = [getattr(signal, name) for name in STOPPING if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        numbers = []
    taken = {number: signal.getsignal(number) for number in numbers}
    taken = {number: handler for number, handler in taken.items() if handler in DEFAULTS}
    again: list[threading.Timer] = []
    for number in taken:
        signal.signal(number, partial(_interrupt, again))
    unraisable, sys.unraisablehook = sys.unraisablehook, partial(_kept, again, sys.unraisablehook)
    try:
        yield
    finally:
        sys.unraisablehook = unraisable
        for timer in again:  # the command has ended: its caller is not to be stopped
            timer.cancel()
        for number, handler in taken.items():
            signal.signal(number, handler)


def _interrupt(again: list[threading.Timer], number: int, frame: FrameType | None) -> None:
    """Stop, but after an import: native modules that are stopped while they load hide the cause."""
    while frame:
        if frame.f_code.co_filename == IMPORTING:
            _send_again(again, number)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _kept(again: list[threading.Timer], others: Callable[[Any], Any], lost: Any) -> None:
    """Stop later when native code that had called Python has dropped the interrupt."""
    if lost.exc_type is KeyboardInterrupt:
        _send_again(again, signal.SIGINT)
    else:
        others(lost)


def _send_again(again: list[threading.Timer], number: int) -> None:
    again.append(threading.Timer(AGAIN_S, os.kill, (os.getpid(), number)))
    again[-1].start()


# The typer library keeps the classes of its errors to itself: they differ in what they hold.
_PARAMETER, _OPTION, _LIKELY = "param", "option_name", "possibilities"

_EXTRA = re.compile(r"^Got unexpected extra argument\(s\) \(")


RENAMED = {"inspection": "order", "export": "dataset"}  # commands, as they were called and are


def check_is_not_renamed(arguments: Sequence[str]) -> None:
    """Refuse the former name of a command, and say the new one."""
    if arguments and (new := RENAMED.get(arguments[0])):
        raise InputError(f"tbcad {arguments[0]} is now called {new}: write tbcad {new}")


def usage_error_text(error: typer.TyperException) -> str:
    """The line for the screen about a wrong command line, in place of typer's and pydantic's."""
    from pydantic import ValidationError

    parameter = getattr(error, _PARAMETER, None)
    if parameter is not None and isinstance(error.__cause__, ValidationError):
        return _wrong_value(parameter, error.__cause__)
    if parameter is not None:
        return f"{_name(parameter)} is missing: name the {_first_lower(parameter.help.rstrip('.'))}"
    if likely := getattr(error, _LIKELY, None):
        option = getattr(error, _OPTION, "")
        return f"there is no option {option}: did you mean {' or '.join(sorted(likely))}?"
    fault = _EXTRA.sub("too many arguments: ", error.message.rstrip(".)"))
    fault = _first_lower(fault).replace(". Did", ": did")
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "tbcad"
    return f"{fault or 'no command is named'}: see {command} --help"


def _wrong_value(parameter: Any, error: "ValidationError") -> str:
    kind, given = parameter.type_descriptor, error.errors(include_url=False)[0]["input"]
    limits = kind.parameter_info.min, kind.parameter_info.max
    one = next(iter(get_args(kind.annotation)), kind.annotation)  # of what is repeatable
    choices = kind.choices if kind.is_choice else [allowed_between(one, *limits)]
    return refusal(_name(parameter), given, " or ".join(choices))


def _name(parameter: Any) -> str:
    """An option as it is written, its long form; an argument as the help calls it."""
    options = [name for name in parameter.opts if name.startswith("-")]
    return str(max(options, key=len, default=parameter.display_name_raw))


def _first_lower(text: str) -> str:
    return text[:1].lower() + text[1:]
