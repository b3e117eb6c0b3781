"""What ends a command from outside: it cleans up first, as after Ctrl-C."""

import errno
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType

from tbcad.errors import ProcessLost, one_line

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
    """What the system has no more of, in a line for the screen; None: the error is another."""
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
    try:
        yield
    finally:
        for timer in again:  # the command has ended: its caller is not to be stopped
            timer.cancel()
        for number, handler in taken.items():
            signal.signal(number, handler)


def _interrupt(again: list[threading.Timer], number: int, frame: FrameType | None) -> None:
    """Stop, but after an import: native modules that are stopped while they load hide the cause."""
    while frame:
        if frame.f_code.co_filename == IMPORTING:
            timer = threading.Timer(AGAIN_S, os.kill, (os.getpid(), number))
            again.append(timer)
            timer.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt
