"""STEP files of printed parts compared with the meshes."""

from __future__ import annotations

from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.record.export import Export
from tbcad_verify.record.prototype_sections import PrintedPart
from tbcad_verify.report.checks import Check, Unknown, guarded
from tbcad_verify.step.part_checks import CHECKS, PartComparison, names_of, run_checks
from tbcad_verify.step.step_file import StepFile, known

CLAIM_SHARE = 1e-5  # see `PartComparison.claim`


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
    export: Export, part: PrintedPart, file: StepFile | Unknown, mass: MassProperties | None
) -> list[Check]:
    def compared() -> list[Check]:
        comparison = PartComparison(part.name, known(file), mass, export.mesh_error_mm, CLAIM_SHARE)
        return run_checks(CHECKS, part.step, comparison)

    return guarded(names_of(CHECKS, part.step), compared)
