"""All programs on all files: two at a time, the answers always in the same order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import partial
from pathlib import Path

from tbcad_verify.programs.mesh_programs import ADMESH, PRUSA_3MF, PRUSA_SLICES, PRUSA_STL
from tbcad_verify.programs.program_query import ExpectedPart, ProgramQuery, sandbox, skipped
from tbcad_verify.programs.step_programs import FREECAD, GMSH
from tbcad_verify.record.files import open_folder
from tbcad_verify.report.checks import Check, guarded
from tbcad_verify.run.child import Limits
from tbcad_verify.types import Progress

PROCESSES = 2
QUERIES = (FREECAD, GMSH, PRUSA_STL, PRUSA_3MF, PRUSA_SLICES, ADMESH)


def check_with_programs(
    folder: Path,
    parts: Sequence[ExpectedPart],
    seconds: float = 300.0,
    progress: Progress = lambda _: None,
    queries: Sequence[ProgramQuery] = QUERIES,
) -> list[Check]:
    """Ask the programs about every file that they open.

    The checks of a program that is not installed are skipped: see `is_skipped`. Those of one that
    crashes, runs out of time or gives no clear answer are unknown. An interrupt kills all of them.

    `folder`: the export; its files should have been compared with the manifest before.
    `progress`: called with program and file before each run, from several threads.

    BadExport: the folder is missing or is no folder.
    """
    limits = Limits(seconds)
    root = open_folder(folder)
    jobs = [
        partial(_answers, root, part, query, limits, progress)
        for part in parts
        for query in queries
    ]
    return [check for checks in _two_at_a_time(jobs, limits) for check in checks]


def _two_at_a_time(jobs: Sequence[Callable[[], list[Check]]], limits: Limits) -> list[list[Check]]:
    with ThreadPoolExecutor(PROCESSES) as pool:
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


def _answers(
    folder: Path, part: ExpectedPart, query: ProgramQuery, limits: Limits, progress: Progress
) -> list[Check]:
    """The checks that one program answers about one file, or why they are skipped."""
    file, command, names = part.files.get(query.kind, ""), query.find(), query.names(part)
    if not file or not command:
        missing = f"not installed: {query.install}"
        reason = missing if file else f"the record names no {query.kind} file"
        return [skipped(name, reason) for name in names]
    progress(f"{query.program}: {file}")

    def ask() -> Sequence[Check]:
        with sandbox(command, folder, file, query.kind, limits) as private:
            return query.ask(private, part, names)

    return guarded(names, ask)
