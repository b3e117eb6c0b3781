"""Work in a process of its own while this one does something else."""

import multiprocessing
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any


@contextmanager
def in_background(work: Callable[..., None], *arguments: Any) -> Iterator[None]:
    """Do work in another process while the block runs, and wait for it at the block's end.

    A block that fails, or is interrupted, ends the work at once.

    Args:
        work: a function of a module.
        arguments: of it; they are copied.

    Raises:
        Exception: what the work raised.
        RuntimeError: its process ended before it was done.
    """
    others = multiprocessing.active_children()
    with ProcessPoolExecutor(1, _context(), initializer=_ignore_interrupts) as pool:
        result = pool.submit(work, *arguments)
        try:
            yield
            result.result()
        except BrokenProcessPool:
            raise RuntimeError(
                "a process ended before its work was done: is memory short?"
            ) from None
        except BaseException:
            for process in set(multiprocessing.active_children()) - set(others):
                process.kill()
            raise


def _context() -> multiprocessing.context.BaseContext:
    """A copy of this process, which has loaded all libraries, where that is safe.

    A copy has no other threads: what they hold locked would stay locked in it.
    """
    alone = sys.platform == "linux" and threading.active_count() == 1
    return multiprocessing.get_context("fork" if alone else "spawn")


def _ignore_interrupts() -> None:
    """An interrupt is for the process that waits, which then ends this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
