"""Work on files in forks of this process, which share what it has loaded.

Native code that crashes, hangs or fills the memory takes only its own fork with it. A fork costs
some hundredths of a second, so small files can share one: where it ends early, the file that it was
at is to blame, and a new fork goes on with those after it.
"""

from __future__ import annotations

import gc
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from tbcad_verify.run.child import crash_reason

Paths = tuple[Path, ...]


def for_each(
    work: Callable[..., None], batches: Sequence[Sequence[Paths]], seconds: float, processes: int
) -> Iterator[tuple[Paths, str]]:
    """Call a function with the paths of every job, in order, those of a batch in one fork.

    Args:
        work: is called with all paths of a job.
        batches: jobs that share a fork; the paths of each job.
        seconds: time limit of each job.
        processes: that work at the same time, at most.

    Yields:
        The paths of each job as it ends, and why it was stopped or crashed, or nothing.
    """
    waiting: list[Sequence[Paths]] = list(reversed(batches))
    running: list[_Fork] = []
    while waiting or running:
        while waiting and len(running) < processes:
            running.append(_Fork(work, waiting.pop(), seconds))
        first = min(fork.deadline for fork in running)
        wait([fork.process.sentinel for fork in running], max(0.0, first - time.monotonic()))
        for fork in running.copy():
            ended = not fork.process.is_alive()  # asked first: then all that it did is known
            yield from ((job, "") for job in fork.done())
            if ended or fork.deadline <= time.monotonic():
                running.remove(fork)
                reason = fork.end(late=not ended)
                yield from ((job, reason) for job in [*fork.jobs][:1])
                waiting += [rest] if (rest := [*fork.jobs][1:]) else []


class _Fork:
    """Jobs that are done one after the other in one fork."""

    def __init__(self, work: Callable[..., None], jobs: Sequence[Paths], seconds: float) -> None:
        """Begin with the first; each has so many seconds."""
        self.jobs, self._seconds = deque(jobs), seconds
        self._done, writer = Pipe(duplex=False)
        self.process: BaseProcess = get_context("fork").Process(
            target=_work_through, args=(work, jobs, writer)
        )
        with writer:
            self.process.start()
        self.deadline = time.monotonic() + seconds

    def done(self) -> Iterator[Paths]:
        """Jobs that were done since this was last asked; those left are in `jobs`."""
        while self.jobs and self._done.poll():
            try:
                self._done.recv_bytes()
            except EOFError:
                return
            self.deadline = time.monotonic() + self._seconds
            yield self.jobs.popleft()

    def end(self, late: bool) -> str:
        """End the fork, or wait for the end that it is at; why, or nothing."""
        if late:
            self.process.kill()
        self.process.join()
        self._done.close()
        if late:
            return f"no answer within {self._seconds:g} s"
        code = self.process.exitcode or 0
        return crash_reason(code) or (f"ended with exit code {code}" if code else "")


def _work_through(work: Callable[..., None], jobs: Sequence[Paths], done: Connection) -> None:
    gc.disable()  # a fork ends soon
    for job in jobs:
        work(*job)
        done.send_bytes(b"done")
