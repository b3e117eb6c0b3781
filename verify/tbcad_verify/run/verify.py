"""The whole proof of an export: every stage in its place, then one report."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.printing.profile import load
from tbcad_verify.programs import ExpectedPart, check_with_programs
from tbcad_verify.prototype import step_files
from tbcad_verify.record.files import listing, open_folder, stamps
from tbcad_verify.record.prototype_record import Printed
from tbcad_verify.record.record import TEXTS, Export, Part, read_export
from tbcad_verify.report.checks import Check, short_list
from tbcad_verify.report.report import Report, findings
from tbcad_verify.run.results import Results
from tbcad_verify.run.stages import run_stages, stages
from tbcad_verify.run.watch import SECONDS, watched, worker
from tbcad_verify.step.shell_checks import shell_step_checks

SUMMED = 1e-3  # of a volume: what programs lose that add up in float32
Stamps = dict[str, tuple[int, ...]]


@dataclass(frozen=True)
class Options:
    """What a user may ask of a proof.

    Attributes:
        write: leave verify.json in the folder.
        apart: read the meshes in a process of its own, so that a crash is told, not suffered.
        seconds: longest that one stage, file or program may take.
        printers: profiles by name or path that every part must suit; none: the built-in ones are
            tried, and what they say is told only.
        clients: ask the programs that users open the files with, where they are installed.
    """

    write: bool = True
    apart: bool = True
    seconds: float = SECONDS
    printers: tuple[str, ...] = ()
    clients: bool = False


def verify(
    folder: Path, progress: Callable[[str], None] = lambda _: None, wishes: Options = Options()
) -> Report:
    """Prove an export, and write verify.json into it.

    Args:
        folder: what `tbcad build` wrote.
        progress: called with the name of each stage before it starts.
        wishes: what else to do, and how.

    Raises:
        BadExport: the folder is no readable export, or cannot be written to; nothing is written.
    """
    for name in wishes.printers:
        load(name)
    root = open_folder(Path(folder))
    before = stamps(root, listing(root))
    export = read_export(root)
    results = Results(progress)
    with ThreadPoolExecutor(1) as pool:
        # Processes of their own, which need nothing from all that comes before their checks.
        early = pool.submit(step_files.read_step_files, export, wishes.seconds)
        if wishes.apart:
            watched(worker(export.folder, wishes.printers), stages(export), results, wishes.seconds)
        else:
            run_stages(export.folder, results, wishes.printers)
        if any(part.step for part in export.parts):
            results.stage("STEP")
            results.checks(shell_step_checks(export, results.bulks, wishes.seconds))
        if export.prototype and any(part.step for part in export.prototype.parts):
            results.stage("STEP of the prototype")
            results.checks(step_files.part_step_checks(export, results.bulks, early.result()))
    programs = _programs(export, results, wishes.seconds) if wishes.clients else []
    _refuse_changes(export, before)
    report = Report(
        export.target_mm,
        tuple(results.found),
        findings(export.mirrors, results.columns),
        tuple(programs),
        tuple(results.printing),
        shell=bool(export.parts),
        prototype=results.machine,
    )
    if wishes.write:
        _write(report, export.folder)
    return report


def _refuse_changes(export: Export, before: Stamps) -> None:
    """A verdict on files that are no longer those that were read is worth nothing."""
    names = {*export.manifest, *TEXTS}
    after = stamps(export.folder, names)
    changed = sorted(name for name in names if after.get(name) != before.get(name))
    if changed:
        raise BadExport(
            f"{short_list(changed)}: changed while it was read; let the build finish, then verify"
        )


def _programs(export: Export, results: Results, seconds: float) -> list[Check]:
    wanted = [_wanted(export, part, results.bulks.get(part.name)) for part in export.parts]
    for part in export.prototype.parts if export.prototype else ():
        wanted.append(_printed(export, part, results.bulks.get(part.name)))
    return check_with_programs(export.folder, wanted, seconds, results.stage)


def _wanted(export: Export, part: Part, bulk: MassProperties | None) -> ExpectedPart:
    """What other programs should find in a part's files."""
    mirrors = export.rows.camera == part.camera
    volume, area = (bulk.volume, bulk.area) if bulk else (math.nan, math.nan)
    return ExpectedPart(
        part.name,
        {"step": part.step, "stl": part.stl, "3mf": part.threemf},
        int((mirrors & ~export.rows.flat).sum()),
        volume,
        max(area * export.mesh_error_mm, SUMMED * abs(volume)),
    )


def _printed(export: Export, part: Printed, bulk: MassProperties | None) -> ExpectedPart:
    """The same of a prototype's part, whose spherical faces nobody counts."""
    volume, area = (bulk.volume, bulk.area) if bulk else (math.nan, math.nan)
    return ExpectedPart(
        part.name,
        {"step": part.step, "stl": part.stl, "3mf": part.threemf},
        None,
        volume,
        max(area * export.mesh_error_mm, SUMMED * abs(volume)),
    )


def _write(report: Report, folder: Path) -> None:
    try:
        report.write(folder)
    except OSError as error:
        raise BadExport(f"{folder}: verify.json cannot be written ({error.strerror})") from error
