"""The verification of a build: all stages, then one report."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tbcad_verify.errors import BadExport
from tbcad_verify.printing.profile import load
from tbcad_verify.programs import ExpectedPart, check_with_programs
from tbcad_verify.prototype.assembly import part_step_checks, printed_step_checks
from tbcad_verify.record.export import TEXTS, Export, listed_names, read_export
from tbcad_verify.record.files import open_folder, stamps
from tbcad_verify.record.validation import PartFiles
from tbcad_verify.report.checks import Check, Unknown, short_list, unknown
from tbcad_verify.report.report import NAME, Report
from tbcad_verify.report.text import strictly
from tbcad_verify.run.processes import ProcessEnded, Processes
from tbcad_verify.run.results import PER_MIRROR, CollectedResults, Results
from tbcad_verify.run.stages import run_in_two, run_stages, stage_titles
from tbcad_verify.step.front_checks import FrontComparison
from tbcad_verify.step.recorded_checks import area_checks, radius_checks
from tbcad_verify.step.shell_checks import Comparisons, compare_all, front_step_checks
from tbcad_verify.step.step_file import PROCESSES, StepFile, read_step_files
from tbcad_verify.types import Progress

STAGE_LIMIT_S = 600.0
LARGEST_CUTTER_MM = 100.0
FLOAT32_SHARE = 1e-3  # of a volume: the error of programs that sum in float32
Stamps = dict[str, tuple[int, ...]]
Files = dict[str, StepFile | Unknown]
Steps = tuple[Files, Comparisons, list[Check]]


@dataclass(frozen=True)
class VerifyOptions:
    """Options of a verification."""

    write: bool = True  # write verify.json into the folder
    # read the meshes in another process, so that a crash there becomes "unknown"
    apart: bool = True
    seconds: float = STAGE_LIMIT_S  # time limit of one stage, file or program
    # profiles, by name or path, that every part must suit. Without any, the built-in ones are
    # tried, and what they find informs only.
    printers: tuple[str, ...] = ()
    # also ask the programs that users open the files with, where they are installed
    clients: bool = False
    # fail also where a file was changed that only people read, such as a list of parts
    strict: bool = False
    cutter_mm: float | None = None  # radius of a ball that must reach all mirrors of a mandrel


def verify(
    folder: Path,
    progress: Progress = lambda _: None,
    options: VerifyOptions = VerifyOptions(),
    idle: Processes | None = None,
    ready: Processes | None = None,
) -> Report:
    """Verify a build, and write verify.json into it.

    `progress`: called with the name of each stage before it starts.
    `idle`: processes that have done their work, and with a kernel loaded can read STEP files.
    `ready`: one that has loaded the stages.

    BadExport: the folder is not a readable build, or cannot be written to; nothing is written.
    """
    for name in options.printers:
        load(name)
    started, root = time.monotonic(), open_folder(Path(folder))
    before = stamps(root, listed_names(root))
    export = read_export(root)
    results = CollectedResults(progress=progress)
    _run(export, options, results, idle, ready)
    programs = _ask_programs(export, results, options.seconds) if options.clients else []
    _refuse_changes(export, before)
    blank = np.full(len(export.mirrors), np.nan)
    report = Report(
        export.target_mm,
        tuple(strictly(results.checks) if options.strict else results.checks),
        export.mirrors,
        {name: results.mirrors.get(name, blank) for name in PER_MIRROR},
        tuple(programs),
        tuple(results.printing),
        shell=bool(export.parts),
        valleys=export.spec.shell.edges == "valley" and bool(export.parts),
        balls=len(export.prototype.balls) if export.prototype else 0,
        folder=folder,
        seconds=time.monotonic() - started,
    )
    if options.write:
        try:
            report.write(root)
        except OSError as error:
            raise BadExport(f"{root}: {NAME} cannot be written ({error.strerror})") from error
    return report


def _run(
    export: Export,
    options: VerifyOptions,
    results: CollectedResults,
    idle: Processes | None,
    ready: Processes | None,
) -> None:
    """All stages; an interrupt ends the processes that read files, which take long."""
    work = export.folder, options.printers, options.cutter_mm
    with _steps(export, options.seconds, idle) as steps:
        # Reading STEP files needs none of the stages, and takes as long as they do.
        if options.apart:
            with Processes(1, options.seconds, ready) as processes:
                watch(stage_titles(export), results, processes, run_in_two, *work)
        else:
            run_stages(*work, results.add)
        _compare_steps(export, results, steps)


def watch(
    titles: Sequence[str],
    results: CollectedResults,
    processes: Processes,
    stages: Callable[..., None],
    *arguments: Any,
) -> None:
    """Do stages in a process, which sends their results; those that it does not end are unknown.

    `stages`: function of a module; takes the arguments, and what receives results.

    BadExport: the folder is not a readable build.
    """
    try:
        processes.call(stages, *arguments, heard=results.add)
    except ProcessEnded as end:
        results.checks += _unknown_stages(titles, results.stages, str(end))


def _unknown_stages(titles: Sequence[str], begun: Sequence[str], reason: str) -> list[Check]:
    """The stage that was under way, and those that were not reached."""
    broken = begun[-1] if begun else titles[0]
    later = [title for title in titles if title not in begun and title != broken]
    return [
        unknown((broken, "", ""), reason),
        *(unknown((title, "", ""), f"not reached: {broken!r} {reason}") for title in later),
    ]


@contextmanager
def _steps(export: Export, seconds: float, idle: Processes | None) -> Iterator[Callable[[], Steps]]:
    """Read STEP files while the block runs; the value waits for them."""
    with ThreadPoolExecutor(1) as pool, Processes(PROCESSES, seconds, idle) as processes:
        yield pool.submit(copy_context().run, _read_steps, export, processes).result


def _read_steps(export: Export, processes: Processes) -> Steps:
    files = read_step_files(export, processes)
    fronts, shells = compare_all(export, files), [part for part in export.parts if part.step]
    found = {part.camera: fronts[part.name] for part in shells}
    grooves = {key: one.grooves for key, one in found.items() if isinstance(one, FrontComparison)}
    return files, fronts, area_checks(export, grooves) if shells else []


def _compare_steps(export: Export, results: CollectedResults, steps: Callable[[], Steps]) -> None:
    masses = results.masses
    if any(part.step for part in export.parts):
        results.add(Results(stages=["STEP"]))
        _, fronts, areas = steps()
        recorded = areas + radius_checks(export, results.mirrors.get("coverage_fitted_mm"))
        solids = front_step_checks(export, export.parts, masses, fronts)
        results.add(Results(checks=recorded + solids))
    if any(part.step for part in export.mandrels):
        results.add(Results(stages=["STEP of the mandrels"]))
        solids = front_step_checks(export, export.mandrels, masses, steps()[1])
        results.add(Results(checks=solids))
    if any(part.step for part in export.rings):
        results.add(Results(stages=["STEP of the lamps' ring"]))
        solids = printed_step_checks(export, export.rings, masses, steps()[0])
        results.add(Results(checks=solids))
    if any(part.step for part in export.printed):
        results.add(Results(stages=["STEP of the prototype"]))
        results.add(Results(checks=part_step_checks(export, masses, steps()[0])))


def _refuse_changes(export: Export, before: Stamps) -> None:
    """A verdict holds for the files that were read, not for others in their place."""
    names = {*export.manifest, *TEXTS}
    after = stamps(export.folder, names)
    changed = sorted(name for name in names if after.get(name) != before.get(name))
    if changed:
        raise BadExport(
            f"{short_list(changed)}: changed while it was read; let the build finish, then verify"
        )


def _ask_programs(export: Export, results: CollectedResults, seconds: float) -> list[Check]:
    cameras = export.mirrors.camera[~export.mirrors.flat]
    parts = [
        _expected(export, part, int((cameras == part.camera).sum()), results)
        for part in (*export.parts, *export.mandrels)
    ]
    others = (*export.printed, *export.rings)
    parts += [_expected(export, part, None, results) for part in others]
    return check_with_programs(export.folder, parts, seconds, results.progress)


def _expected(
    export: Export, part: PartFiles, spheres: int | None, results: Results
) -> ExpectedPart:
    """Contents that other programs should find in a part's files."""
    mass = results.masses.get(part.name)
    volume, area = (mass.volume, mass.area) if mass else (math.nan, math.nan)
    return ExpectedPart(
        part.name,
        {"step": part.step, "stl": part.stl, "3mf": part.threemf},
        spheres,
        volume,
        max(area * export.mesh_error_mm, FLOAT32_SHARE * abs(volume)),
    )
