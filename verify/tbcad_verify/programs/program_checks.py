"""All programs on all files: two at a time, the answers always in the same order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import partial
from pathlib import Path

from tbcad_verify.programs import admesh, freecad, gmsh, prusa
from tbcad_verify.programs.answers import skipped
from tbcad_verify.programs.program_query import Command, ExpectedPart, ProgramQuery, sandbox
from tbcad_verify.record.files import open_folder
from tbcad_verify.report.checks import Check, guarded
from tbcad_verify.run.child import Limits
from tbcad_verify.types import Progress

AT_ONCE = 2
QUERIES = (freecad.STEP, gmsh.STEP, prusa.STL, prusa.THREEMF, prusa.SLICES, admesh.STL)


def check_with_programs(
    folder: Path,
    wanted: Sequence[ExpectedPart],
    seconds: float = 300.0,
    progress: Progress = lambda _: None,
    errands: Sequence[ProgramQuery] = QUERIES,
) -> list[Check]:
    """Ask the programs about every file that they open.

    A program that is not installed is skipped: see `is_skipped`. One that crashes, runs out of
    time or gives no clear answer leaves its checks unknown. An interrupt kills those that run.

    Args:
        folder: the export; its files should have been held against the manifest before.
        wanted: its parts.
        seconds: time limit of one run of one program.
        progress: called with program and file before each run, from several threads.
        errands: what is asked.

    Raises:
        BadExport: the folder is missing or is no folder.
    """
    limits = Limits(seconds)
    root = open_folder(folder)
    jobs = [
        partial(_settle, root, part, errand, limits, progress)
        for part in wanted
        for errand in errands
    ]
    return [check for checks in _two_at_a_time(jobs, limits) for check in checks]


def _two_at_a_time(jobs: Sequence[Callable[[], list[Check]]], limits: Limits) -> list[list[Check]]:
    with ThreadPoolExecutor(AT_ONCE) as pool:
        try:
            running = [pool.submit(job) for job in jobs]
            done, _ = wait(running, return_when=FIRST_EXCEPTION)
            for one in done:
                one.result()  # raises what broke
            return [one.result() for one in running]
        except BaseException:
            limits.stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _settle(
    folder: Path, part: ExpectedPart, errand: ProgramQuery, limits: Limits, progress: Progress
) -> list[Check]:
    file = part.files.get(errand.kind, "")
    if not file:
        reason = f"the record names no {errand.kind} file"
        return [skipped(name, reason) for name in errand.names(part)]
    command = errand.find()
    if not command:
        reason = f"not installed: {errand.install}"
        return [skipped(name, reason) for name in errand.names(part)]
    progress(f"{errand.program}: {file}")
    return guarded(errand.names(part), lambda: _ask(folder, part, errand, command, limits))


def _ask(
    folder: Path, part: ExpectedPart, errand: ProgramQuery, command: Command, limits: Limits
) -> Sequence[Check]:
    with sandbox(command, folder, part.files[errand.kind], errand.kind, limits) as given:
        return errand.ask(given, part)
