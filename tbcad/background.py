"""Work in a process of its own while this one does something else.

Only in a command's own process: for a user of the library all work is done here, to the same bytes.
"""

import ctypes
import multiprocessing
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from typing import Any, TypeAlias

from tbcad.own_process import is_own_process

PR_SET_PDEATHSIG = 1  # prctl(2): the signal to get when the parent ends

_repeated: list["Repeated"] = []  # those at work

Submit: TypeAlias = Callable[..., "Future[Any]"]
"""Takes a function of a module and its arguments, which are copied; the result comes later."""


def at_once(work: Callable[..., Any], *arguments: Any) -> "Future[Any]":
    """Do work here and now, where there is no other process.

    What it takes and returns is copied as by a process: solids lose the sign of zeros on the way,
    and files are to have the same bytes.
    """
    future: Future[Any] = Future()
    work, arguments = _copied((work, arguments))
    future.set_result(_copied(work(*arguments)))
    return future


def _copied(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


@contextmanager
def background_process() -> Iterator[Submit]:
    """Do work in another process, a piece after the other, while the block runs.

    At the block's end all of it is done. A block that fails, or is interrupted, ends it at once.

    Raises:
        Exception: the first that the work raised.
        RuntimeError: the process ended before its work was done.
    """
    if not is_own_process():
        yield at_once
        return
    others, futures = multiprocessing.active_children(), list[Future[Any]]()
    with ProcessPoolExecutor(1, _context(), initializer=end_with_parent) as pool:

        def submit(work: Callable[..., Any], *arguments: Any) -> "Future[Any]":
            with nullcontext() if futures else pause():  # the first starts the process
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
    """A copy of this process, which has loaded all libraries, where that is safe."""
    return multiprocessing.get_context("fork" if may_fork() else "spawn")


def may_fork() -> bool:
    """Whether this process is a command's, which can be copied during a `pause`.

    A copy has no other threads: what they hold locked would stay locked in it.
    """
    paused = sum(one.running for one in _repeated)
    return is_own_process() and sys.platform == "linux" and threading.active_count() - paused == 1


class Repeated:
    """A function that a thread calls again and again while the block runs, but for a `pause`."""

    def __init__(self, work: Callable[[], object], seconds: float) -> None:
        """Call the function after each interval, seconds."""
        self._work, self._seconds = work, seconds
        self._thread: threading.Thread | None = None
        self._end = threading.Event()

    @property
    def running(self) -> bool:
        """Whether its thread is there."""
        return self._thread is not None

    def start(self) -> None:
        """Begin to call."""
        self._end.clear()
        self._thread = threading.Thread(target=self._repeat, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread and wait for its end."""
        self._end.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _repeat(self) -> None:
        while not self._end.wait(self._seconds):
            self._work()

    def __enter__(self) -> "Repeated":
        """Begin."""
        _repeated.append(self)
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        _repeated.remove(self)
        self.stop()


@contextmanager
def pause() -> Iterator[None]:
    """End the threads of all repeated functions for this block, so that it can copy the process."""
    running = [one for one in _repeated if one.running]
    for one in running:
        one.stop()
    try:
        yield
    finally:
        for one in running:
            one.start()


def end_with_parent() -> None:
    """End with the process that waits, also when that is killed; leave interrupts to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # which a command takes for an interrupt
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
