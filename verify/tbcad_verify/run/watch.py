"""Running stages in another process, with a limit on how long each may take."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from tbcad_verify.report.checks import unknown
from tbcad_verify.run.results import Results, replay

SECONDS = 600.0


def worker(folder: Path, printers: Sequence[str]) -> list[str]:
    """The command that proves a folder."""
    # -P: what lies in the current folder, which may be the export, must not be imported.
    return [sys.executable, "-P", "-m", "tbcad_verify.run.worker", str(folder), *printers]


def watched(
    command: Sequence[str], stages: Sequence[str], results: Results, seconds: float
) -> None:
    """Run a process that tells `results.Lines`; stages that do not come to an end are unknown.

    Args:
        command: program and arguments.
        stages: titles of all stages, in order.
        results: takes what comes.
        seconds: longest that one stage may take.

    Raises:
        BadExport: the folder is no readable export.
    """
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        encoding="utf-8",
        start_new_session=True,
    ) as process:
        try:
            reason = _followed(process, results, seconds)
        finally:
            _stop(process)
    if reason:
        _call_unknown(stages, results, reason)


def _followed(process: subprocess.Popen[str], results: Results, seconds: float) -> str:
    """Hand on all lines; why they ended too early, or nothing."""
    lines: queue.Queue[str] = queue.Queue()
    assert process.stdout is not None
    threading.Thread(target=_pump, args=(process.stdout, lines), daemon=True).start()
    while True:
        try:
            line = lines.get(timeout=seconds)
        except queue.Empty:
            return f"took more than {seconds:g} s and was stopped"
        if not line:
            return _ending(process)
        try:
            if replay(line, results):
                return ""
        except (ValueError, LookupError, TypeError):
            return "said what nobody understands"


def _pump(stream: TextIO, lines: queue.Queue[str]) -> None:
    for line in stream:
        lines.put(line)
    lines.put("")


def _ending(process: subprocess.Popen[str]) -> str:
    code = process.wait()
    if code < 0:
        return f"crashed ({signal.Signals(-code).name})"
    return f"ended with exit code {code}"


def _stop(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)


def _call_unknown(stages: Sequence[str], results: Results, reason: str) -> None:
    """The stage that was under way, and those it kept from being made."""
    broken = results.stages[-1] if results.stages else stages[0]
    later = [title for title in stages if title not in results.stages and title != broken]
    results.checks(
        [
            unknown((broken, "", ""), reason),
            *(unknown((title, "", ""), f"not reached: {broken!r} {reason}") for title in later),
        ]
    )
