"""Work in a process of its own while this one does something else."""

import multiprocessing
import signal
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
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn, initializer=_ignore_interrupts) as pool:
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


def _ignore_interrupts() -> None:
    """An interrupt is for the process that waits, which then ends this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
