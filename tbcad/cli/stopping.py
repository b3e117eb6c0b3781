"""What ends a command from outside: it cleans up first, as after Ctrl-C."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130  # exit code of a command that is stopped, from the keyboard or by a signal
STOPPING = ("SIGTERM", "SIGHUP")


class Stopped(Exception):
    """A command was stopped and has kept something; its text says what, and how to go on."""


@contextmanager
def signals_as_interrupt() -> Iterator[None]:
    """Let a kill or a closed terminal raise KeyboardInterrupt during the block.

    A signal that is ignored, as by nohup, stays so; handlers belong to the main thread.
    """
    numbers = [getattr(signal, name) for name in STOPPING if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        numbers = []
    taken = [number for number in numbers if signal.getsignal(number) == signal.SIG_DFL]
    for number in taken:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)
