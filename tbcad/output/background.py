"""Work in a process of its own while this one does something else."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
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
    context = multiprocessing.get_context("spawn")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(theirs, work, arguments), daemon=True)
    process.start()
    theirs.close()
    try:
        yield
        _wait(mine)
    finally:
        process.kill()
        process.join()
        mine.close()


def _work(answer: Connection, work: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    """In the other process: an interrupt is for the one that waits, which then ends this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        work(*arguments)
    except Exception as error:
        answer.send(error)
    else:
        answer.send(None)


def _wait(answer: Connection) -> None:
    try:
        error = answer.recv()
    except EOFError:
        raise RuntimeError("a process ended before its work was done: is memory short?") from None
    if error is not None:
        raise error
