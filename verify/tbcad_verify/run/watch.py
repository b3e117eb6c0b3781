"""Running the stages in another process, with a limit on how long each may take."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from tbcad_verify.errors import BadExport
from tbcad_verify.report.checks import Check, unknown
from tbcad_verify.run.child import Child, crash_reason, kill_group
from tbcad_verify.run.fork import start_fork
from tbcad_verify.run.results import CollectedResults, Results

STAGE_LIMIT_S = 600.0
UNREADABLE = "sent a message that cannot be read"


def worker_command(folder: Path, printers: Sequence[str]) -> list[str]:
    """The command that runs the stages on a folder."""
    # -P: modules in the current folder, which may be the export, must not be imported.
    return [sys.executable, "-P", "-m", "tbcad_verify.run.worker", str(folder), *printers]


def watch(
    command: Sequence[str] | Callable[[Connection], None],
    titles: Sequence[str],
    results: CollectedResults,
    seconds: float,
) -> None:
    """Run a worker process, which sends its results; stages that it does not end are unknown.

    Args:
        command: program and arguments, whose stdout is the pipe to which it sends; or a function,
            called in a copy of this process, which is given that pipe.
        titles: of all stages, in order.
        results: are added to.
        seconds: time limit of one stage.

    Raises:
        BadExport: the folder is not a readable export.
    """
    reader, writer = Pipe(duplex=False)
    with reader, ThreadPoolExecutor(1) as receiver:
        with writer:
            process = _start(command, writer)
        try:
            reason = _collect(process, lambda: receiver.submit(reader.recv), results, seconds)
        finally:
            kill_group(process)  # and so closes the pipe, for which the receiver may still wait
    if reason:
        results.checks += _unknown_stages(titles, results.stages, reason)


def _start(command: Sequence[str] | Callable[[Connection], None], writer: Connection) -> Child:
    if callable(command):
        return start_fork(command, writer, group=True)
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=writer.fileno(),
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def _collect(
    process: Child,
    receive: Callable[[], Future[Any]],
    results: CollectedResults,
    seconds: float,
) -> str:
    """Add what a worker sends to the results; why it sent no end, or nothing."""
    while True:
        try:
            message = receive().result(seconds)
        except TimeoutError:
            return f"took more than {seconds:g} s and was stopped"
        except (EOFError, OSError):
            code = process.wait()
            return crash_reason(code) or f"ended with exit code {code}"
        except Exception:  # whatever pickle raises
            return UNREADABLE
        if message is None:
            return ""
        if isinstance(message, BadExport):
            raise message
        if not isinstance(message, Results):
            return UNREADABLE
        results.add(message)


def _unknown_stages(titles: Sequence[str], begun: Sequence[str], reason: str) -> list[Check]:
    """The stage that was under way, and those that were not reached."""
    broken = begun[-1] if begun else titles[0]
    later = [title for title in titles if title not in begun and title != broken]
    return [
        unknown((broken, "", ""), reason),
        *(unknown((title, "", ""), f"not reached: {broken!r} {reason}") for title in later),
    ]
