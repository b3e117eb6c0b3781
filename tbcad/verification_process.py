"""A process that verifies an export: a copy of this one from before the export was made.

So it has loaded all libraries and has nothing else in memory, and no threads; it can copy itself.
"""

import multiprocessing
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TypeAlias

from tbcad_verify.report.report import Report
from tbcad_verify.run.fork import outcome_of
from tbcad_verify.run.verify import VerifyOptions, verify

from tbcad.background import end_with_parent, may_fork, pause
from tbcad.types import Progress

ENDED = "the process that verifies ended: is memory short?"

Verify: TypeAlias = Callable[[Path, Progress], Report]
"""Verifies a folder, and reports each stage."""


@contextmanager
def verification_process(needed: bool = True) -> Iterator[Verify]:
    """Verify in a copy of this process, which ends with the block; where it is not safe, here."""
    if not (needed and may_fork()):
        yield _verify_here
        return
    context = multiprocessing.get_context("fork")
    pipe, other = context.Pipe()
    process = context.Process(target=_serve, args=(other, pipe))
    with pause():
        process.start()
    other.close()
    try:
        with pipe:
            yield partial(_ask, pipe)
    finally:
        process.kill()
        process.join()


def _verify_here(folder: Path, progress: Progress) -> Report:
    return verify(folder, progress)


def _ask(pipe: Connection, folder: Path, progress: Progress) -> Report:
    pipe.send(folder)
    while True:
        try:
            answer = pipe.recv()
        except EOFError:
            raise RuntimeError(ENDED) from None
        if isinstance(answer, Report):
            return answer
        if isinstance(answer, Exception):
            raise answer
        progress(answer)


def _serve(pipe: Connection, other: Connection) -> None:
    end_with_parent()
    other.close()
    _load()
    try:
        folder = pipe.recv()
    except EOFError:
        return
    pipe.send(outcome_of(lambda: verify(folder, pipe.send, VerifyOptions(fork=True))))


def _load() -> None:
    """Load what is imported where it is used."""
    import tbcad_verify.step.kernel.reading  # noqa: F401
