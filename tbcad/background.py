"""Work in a process of its own while this one does something else."""

import ctypes
import multiprocessing
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeAlias

PR_SET_PDEATHSIG = 1  # prctl(2): the signal to get when the parent ends

Submit: TypeAlias = Callable[..., "Future[Any]"]
"""Takes a function of a module and its arguments, which are copied; the result comes later."""


def at_once(work: Callable[..., Any], *arguments: Any) -> "Future[Any]":
    """Do work here and now, where there is no other process."""
    future: Future[Any] = Future()
    future.set_result(work(*arguments))
    return future


@contextmanager
def background_process() -> Iterator[Submit]:
    """Do work in another process, a piece after the other, while the block runs.

    At the block's end all of it is done. A block that fails, or is interrupted, ends it at once.

    Raises:
        Exception: the first that the work raised.
        RuntimeError: the process ended before its work was done.
    """
    others, futures = multiprocessing.active_children(), list[Future[Any]]()
    with ProcessPoolExecutor(1, _context(), initializer=_begin) as pool:

        def submit(work: Callable[..., Any], *arguments: Any) -> "Future[Any]":
            futures.append(pool.submit(work, *arguments))
            return futures[-1]

        try:
            yield submit
            for future in futures:
                future.result()
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


def _begin() -> None:
    """End with the process that waits, also when that is killed; leave interrupts to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
