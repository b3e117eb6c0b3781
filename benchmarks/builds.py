"""Whole commands as a user runs them, a process each: `tbcad build` with verification."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from timing import Figure, Row, at_most

COMMAND = "from tbcad.app.cli import main; main()"  # what the installed program does
ENDS = {0: "done", 1: "done, the verification fails"}
REFUSED = 2
INSTALLED = {"PYTHONSAFEPATH": "1", "TBCAD_CACHE": ""}
"""The interpreter's own tbcad, not that of the working directory; builds that reuse nothing."""
CRASHED = b"Traceback (most recent call last)"  # a crash exits with 1, too
MEGABYTE = 1e6


@dataclass(frozen=True)
class Build:
    """What one command took.

    Attributes:
        seconds: on the clock.
        cpu: seconds of all cores, user and system.
        memory: the most, GB.
        verdict: one of ENDS, or that it was refused.
        answer: seconds on the clock until its first answer; None: it was not waited for.
    """

    seconds: float
    cpu: float
    memory: float
    verdict: str
    answer: float | None = None


def run(
    folder: Path,
    *arguments: str,
    environment: dict[str, str] | None = None,
    python: Path = Path(sys.executable),
    refused: bool = False,
    answer: str = "",
) -> Build:
    """Run one command of an interpreter's tbcad; its words go to a file in the folder.

    The first line of its progress that has `answer` in it is its first answer.

    To be called before anything heavy is imported: the system counts the memory of the process
    that starts another one as that one's, until it runs its own program.
    """
    command = [str(python), "-c", COMMAND, *arguments]
    start = time.perf_counter()
    answered = None
    with (folder / "log.txt").open("w+b") as log:
        variables = os.environ | INSTALLED | (environment or {})
        variables.pop("PYTHONDONTWRITEBYTECODE", None)  # pip compiles what it installs
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.PIPE, env=variables)
        for line in process.stderr or ():
            log.write(line)
            if answer and answered is None and answer.encode() in line:
                answered = time.perf_counter() - start
        _, status, used = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        log.seek(0)
        words = log.read()
    expected = process.returncode in ({REFUSED} if refused else ENDS)
    if not expected or CRASHED in words:
        code = process.returncode
        raise RuntimeError(f"{' '.join(command)}: exit code {code}\n{words.decode()}")
    cpu = used.ru_utime + used.ru_stime
    verdict = ENDS.get(process.returncode, "refused")
    return Build(seconds, cpu, used.ru_maxrss * 1024 / 1e9, verdict, answered)


def step_sizes(export: Path) -> list[Row]:
    """Both STEP files of an export."""
    return [
        at_most(path.name, Figure((path.stat().st_size / MEGABYTE,)), 3, "MB")
        for path in sorted(export.glob("*.step"))
    ]
