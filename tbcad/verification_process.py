"""A process that verifies an export: a copy of this one from before the export was made.

So it has loaded all libraries and has nothing else in memory, and no threads; it can copy itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from tbcad.background import may_fork
from tbcad.process_copy import copied_process, next_result
from tbcad.types import Progress

if TYPE_CHECKING:
    from tbcad_verify.report.report import Report

ENDED = "the process that verifies ended: is memory short?"

Verify: TypeAlias = "Callable[[Path, Progress], Report]"
"""Verifies a folder, and reports each stage."""


@contextmanager
def verification_process(needed: bool = True) -> Iterator[Verify]:
    """Verify in a copy of this process, which ends with the block; where it is not safe, here."""
    if not (needed and may_fork()):
        yield _verify_here
        return
    with copied_process(_serve) as pipe:
        yield partial(_ask, pipe)


def _verify_here(folder: Path, progress: Progress) -> Report:
    from tbcad_verify.run.verify import verify

    return verify(folder, progress)


def _ask(pipe: Connection, folder: Path, progress: Progress) -> Report:
    pipe.send(folder)
    report: Report = next_result(pipe, progress, ENDED)
    return report


def _serve(pipe: Connection) -> None:
    import tbcad_verify.step.kernel.reading  # noqa: F401  # else imported where it is used
    from tbcad_verify.run.fork import outcome_of
    from tbcad_verify.run.verify import VerifyOptions, verify

    try:
        folder = pipe.recv()
    except EOFError:
        return
    pipe.send(outcome_of(lambda: verify(folder, pipe.send, VerifyOptions(fork=True))))
