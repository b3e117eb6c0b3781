"""Work on files in forks of this process, which share what it has loaded.

Native code that crashes, hangs or fills the memory takes only its own fork with it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from tbcad_verify.run.child import crash_reason

Paths = tuple[Path, ...]


def for_each(
    work: Callable[..., None], jobs: Sequence[Paths], seconds: float, processes: int
) -> Iterator[tuple[Paths, str]]:
    """Call a function with the paths of every job, each in a fork, in the order given.

    Args:
        work: is called with all paths of a job.
        jobs: the paths of each.
        seconds: time limit of each.
        processes: that work at the same time, at most.

    Yields:
        The paths of each job as its fork ends, and why it was stopped or crashed, or nothing.
    """
    waiting = list(reversed(jobs))
    running: dict[int, tuple[BaseProcess, Paths, float]] = {}
    while waiting or running:
        while waiting and len(running) < processes:
            job = waiting.pop()
            fork: BaseProcess = get_context("fork").Process(target=work, args=job)
            fork.start()
            running[fork.sentinel] = fork, job, time.monotonic() + seconds
        first = min(deadline for _, _, deadline in running.values())
        ended = wait(list(running), max(0.0, first - time.monotonic()))
        for sentinel, (fork, job, deadline) in list(running.items()):
            if sentinel in ended or deadline <= time.monotonic():
                del running[sentinel]
                yield job, _end(fork, sentinel not in ended, seconds)


def _end(fork: BaseProcess, late: bool, seconds: float) -> str:
    """End a fork, or wait for the end that it is at; why it must be, or crashed, or nothing."""
    if late:
        fork.kill()
    fork.join()
    if late:
        return f"no answer within {seconds:g} s"
    code = fork.exitcode or 0
    return crash_reason(code) or (f"ended with exit code {code}" if code else "")
