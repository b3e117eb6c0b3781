"""A copy of this process, which has loaded all that this one has, and what it sends back."""

import multiprocessing
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, TypeAlias

from tbcad.background import end_with_parent, pause
from tbcad.loading import held_signals
from tbcad.types import Progress

Serve: TypeAlias = Callable[[Connection], None]
"""Works in the copy: takes requests from the pipe, and sends progress as texts, then results."""


@contextmanager
def copied_process(serve: Serve) -> Iterator[Connection]:
    """Start a copy of this process, give the pipe to it, and end it with the block.

    Only where `background.may_fork` says that it is safe.
    """
    context = multiprocessing.get_context("fork")
    pipe, other = context.Pipe()
    process: BaseProcess = context.Process(target=_run, args=(serve, other, pipe))
    try:
        with pause(), held_signals():  # Python drops an interrupt in what it does after a copy
            process.start()
        other.close()
        yield pipe
    finally:
        if process.pid is not None:
            process.kill()  # before the pipe is closed, of which it would complain
            process.join()
        pipe.close()


def next_result(pipe: Connection, progress: Progress, ended: str) -> Any:
    """Wait for the next result of the copy.

    Args:
        pipe: to it.
        progress: called with each text that comes before the result.
        ended: what to say when the copy ended without a result.

    Raises:
        Exception: that the copy sent instead of a result.
        RuntimeError: the copy ended.
    """
    while True:
        try:
            answer = pipe.recv()
        except EOFError:
            raise RuntimeError(ended) from None
        if isinstance(answer, Exception):
            raise answer
        if not isinstance(answer, str):
            return answer
        progress(answer)


def _run(serve: Serve, own: Connection, others: Connection) -> None:
    end_with_parent()
    others.close()
    serve(own)
