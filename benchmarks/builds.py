"""Whole commands as a user runs them, a process each: `tbcad build` with verification."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from timing import Figure, Row, at_most, measured

COMMAND = "import sys; from tbcad.cli import run; sys.exit(run(sys.argv[1:]))"
BUILT = {0: "verified", 1: "built, the verification fails"}
MEGABYTE = 1e6
SHELLS = ("--parts", "shell")
# At this size float32 rounding costs facets up to 0.7 mm of coverage: docs/construction.md.
LARGEST = ("--n", "60", "--set", "mirrors.margin_mm=1")


@dataclass(frozen=True)
class Build:
    """What one command took: seconds on the clock and of both cores, and the most memory, GB."""

    seconds: float
    cpu: float
    memory: float
    verdict: str


def build(out: Path, *options: str) -> Build:
    """Run one build."""
    return run(out.parent, "build", "--out", str(out), *options)


def run(folder: Path, *arguments: str, environment: dict[str, str] | None = None) -> Build:
    """Run one command of tbcad; its words go to a file in the folder.

    To be called before anything heavy is imported: the system counts the memory of the process
    that starts another one as that one's, until it runs its own program.
    """
    command = [sys.executable, "-c", COMMAND, *arguments]
    start = time.perf_counter()
    with (folder / "log.txt").open("w+", encoding="utf-8") as log:
        variables = {**os.environ, **(environment or {})}
        process = subprocess.Popen(command, stdout=log, stderr=log, env=variables)
        _, status, used = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in BUILT:
            log.seek(0)
            raise RuntimeError(f"{' '.join(command)}: exit code {process.returncode}\n{log.read()}")
    cpu = used.ru_utime + used.ru_stime
    return Build(seconds, cpu, used.ru_maxrss * 1024 / 1e9, BUILT[process.returncode])


def small_and_large(folder: Path, rounds: int) -> list[Row]:
    """n = 18 and n = 36 in turns; the first one's files stay in `folder`/18."""
    runs: dict[int, list[Build]] = {18: [], 36: []}
    for turn in range(rounds):
        for n in (18, 36) if turn % 2 == 0 else (36, 18):
            runs[n].append(build(folder / str(n), "--n", str(n), *SHELLS))
    small, large = (Figure(tuple(run.seconds for run in runs[n])) for n in (18, 36))
    cpu = [Figure(tuple(run.cpu for run in runs[n])) for n in (18, 36)]
    memory = [Figure(tuple(run.memory for run in runs[n])) for n in (18, 36)]
    return [
        at_most("shells, n = 18", small, 30, "s"),
        measured("- seconds of both cores together", cpu[0], "s"),
        at_most("- most memory", memory[0], 2, "GB"),
        measured("shells, n = 36", large, "s"),
        measured("- seconds of both cores together", cpu[1], "s"),
        measured("- most memory", memory[1], "GB"),
        at_most("shells, n = 36 to n = 18", large.over(small), 4.5, "times"),
        measured("- seconds of both cores together", cpu[1].over(cpu[0]), "times"),
    ]


def whole(folder: Path, rounds: int) -> list[Row]:
    """The paper's design with its prototype, as the README's first command builds it."""
    runs = [build(folder / "whole", "--n", "18") for _ in range(rounds)]
    return [
        at_most(
            "shells and prototype, n = 18", Figure(tuple(run.seconds for run in runs)), 90, "s"
        ),
        measured("- seconds of both cores together", Figure(tuple(run.cpu for run in runs)), "s"),
        at_most("- most memory", Figure(tuple(run.memory for run in runs)), 2, "GB"),
    ]


def largest(folder: Path) -> list[Row]:
    """The largest n there is, once."""
    run = build(folder / "60", *LARGEST, *SHELLS)
    return [
        measured(f"shells, n = 60, margin 1 mm, {run.verdict}", Figure((run.seconds,)), "s"),
        measured("- most memory", Figure((run.memory,)), "GB"),
    ]


def step_sizes(export: Path) -> list[Row]:
    """Both STEP files of an export."""
    return [
        at_most(path.name, Figure((path.stat().st_size / MEGABYTE,)), 3, "MB")
        for path in sorted(export.glob("*.step"))
    ]
