"""STEP files of printed parts, read by other processes and compared with the meshes."""

from __future__ import annotations

from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.mesh.rays import in_threads
from tbcad_verify.record.export import Export
from tbcad_verify.record.prototype import Printed
from tbcad_verify.report.checks import Check, Unknown, guarded
from tbcad_verify.run.child import Limits
from tbcad_verify.step.part_checks import CHECKS, PartComparison, names_of, run_checks
from tbcad_verify.step.step_file import StepFile, examine_all, load

PROCESSES = 2  # each with its share of the files
CLAIM_SHARE = 1e-5  # see `PartComparison.claim`


def read_step_files(export: Export, limits: Limits) -> dict[str, StepFile | Unknown]:
    """The STEP files of a prototype's parts, or why one is not known, by part.

    Args:
        export: the record.
        limits: of a process that reads some of the files.

    Raises:
        BadExport: a file is missing, foreign or truncated.
    """
    parts = [part for part in export.printed if part.step]
    # The largest first, so that the processes take about equally long.
    blobs = [load(export.folder, part.step) for part in parts]
    order = sorted(range(len(parts)), key=lambda k: (-blobs[k].data.size, k))
    shares = [order[k::PROCESSES] for k in range(PROCESSES) if order[k::PROCESSES]]
    answers = in_threads(lambda share: examine_all([blobs[k] for k in share], limits), shares)
    return {
        parts[k].name: answer
        for share, some in zip(shares, answers, strict=True)
        for k, answer in zip(share, some, strict=True)
    }


def part_step_checks(
    export: Export, masses: dict[str, MassProperties], files: dict[str, StepFile | Unknown]
) -> list[Check]:
    """All checks of the STEP files of a prototype's parts.

    Args:
        export: the record.
        masses: figures of the meshes moved back to their places, by part.
        files: as read, by part.
    """
    return [
        check
        for part in export.printed
        if part.step
        for check in _part(export, part, files[part.name], masses.get(part.name))
    ]


def _part(
    export: Export, part: Printed, file: StepFile | Unknown, mass: MassProperties | None
) -> list[Check]:
    def compared() -> list[Check]:
        if isinstance(file, Unknown):
            raise file
        comparison = PartComparison(part.name, file, mass, export.mesh_error_mm, CLAIM_SHARE)
        return run_checks(CHECKS, part.step, comparison)

    return guarded(names_of(CHECKS, part.step), compared)
