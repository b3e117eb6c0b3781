"""Work in a process of its own while this one does something else."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, TypeAlias

from tbcad_verify.run.processes import ProcessEnded, Processes, at_once

from tbcad.errors import ProcessLost

__all__ = ["Submit", "at_once", "background_processes"]

Submit: TypeAlias = Callable[..., "Future[Any]"]
"""Takes a function of a module and its arguments, which are copied; the result comes later."""


@contextmanager
def background_processes(number: int = 1) -> Iterator[Submit]:
    """Do work in other processes, each a piece after the other, while the block runs.

    At the block's end all of it is done. A block that fails, or is interrupted, ends it at once.

    Raises:
        Exception: the first that the work raised.
        ProcessLost: a process ended before its work was done.
    """
    futures: list[Future[Any]] = []
    with Processes(number) as processes:

        def submit(work: Callable[..., Any], *arguments: Any) -> "Future[Any]":
            futures.append(processes.submit(work, *arguments))
            return futures[-1]

        try:
            yield submit
            for future in futures:
                future.result()
        except ProcessEnded as end:
            raise ProcessLost(f"a process ended before its work was done: {end}") from None
