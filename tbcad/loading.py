"""Loading of libraries that bring very many objects, and other moments that no signal may cut."""

import gc
import signal
from collections.abc import Iterator
from contextlib import contextmanager

from tbcad.own_process import is_own_process


@contextmanager
def large_libraries() -> Iterator[None]:
    """Load libraries in this block without looking for garbage among their objects, then or later.

    The CAD kernel brings several hundred thousand: searching them again and again while they grow
    takes a quarter of the time of loading them. What ends the command waits for the block's end:
    native modules that are interrupted while they load hide or change the interrupt. In a user's
    process this does nothing: the user's garbage would be kept for ever.
    """
    if not is_own_process():
        yield
        return
    enabled = gc.isenabled()
    gc.disable()
    try:
        with held_signals():
            yield
    finally:
        gc.freeze()
        if enabled:
            gc.enable()


@contextmanager
def held_signals() -> Iterator[None]:
    """Deliver signals that end a command after this block, where the system can hold them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    ending = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ending)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
