"""The files of a design: written, verified, and put in place of those of an earlier build."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tbcad_verify.report.as_made import AsMade
from tbcad_verify.report.report import Report

from tbcad.api.verification import checked_report
from tbcad.background import background_process
from tbcad.design_process import DesignAhead
from tbcad.mirrors.array import MirrorDesign
from tbcad.output.build import Export, write_export
from tbcad.output.folder import replacing
from tbcad.output.parts import SHELL
from tbcad.report.page.write import write_report
from tbcad.types import Progress
from tbcad.verification_process import verification_process


def build_files(
    ahead: DesignAhead,
    out: Path,
    parts: Sequence[str],
    verify: bool,
    force: bool,
    optional_prototype: bool,
    progress: Progress,
    detail: Progress,
) -> tuple[MirrorDesign, Export, Report | None]:
    """Write all files of a design, verify them, write report.html, and replace the folder.

    Args:
        ahead: the mirrors, which are being computed.
        out: folder to write.
        parts: "shell", "prototype" or both.
        verify: verify the files before they replace those of an earlier build.
        force: keep files in the folder that tbcad did not write, instead of refusing.
        optional_prototype: leave the prototype out where it cannot be made, instead of refusing.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        The mirrors, what was written, and the verification; None when it was not asked for.

    Raises:
        InputError: the folder cannot be replaced, or the design cannot be made.
    """
    with verification_process(needed=verify) as verify_files:
        mirrors = ahead.mirrors(detail)
        with replacing(out, "build", force) as folder:
            with background_process() as submit:
                simulated = submit(_as_made, mirrors) if verify and SHELL in parts else None
                export = write_export(
                    mirrors,
                    folder,
                    parts,
                    progress,
                    submit,
                    ahead.arrangements(mirrors),
                    optional_prototype=optional_prototype,
                )
            report = None
            if verify:
                # The files are read back before they replace the old ones.
                report = replace(
                    checked_report(verify_files, folder, progress),
                    folder=out,
                    note=export.note,
                    as_made=simulated.result() if simulated else None,
                )
            progress("report")
            write_report(folder, as_made=report.as_made if report else None)
    return mirrors, export, report


def _as_made(mirrors: MirrorDesign) -> AsMade:
    """Simulate a few builds of a design by every built-in process."""
    from tbcad.simulate.scene.reflector import reflectors
    from tbcad.tolerance.as_made import as_made

    spec = mirrors.spec
    target, coat = spec.optics.capture_diameter_mm, spec.mirrors.coating_um
    return as_made(reflectors(mirrors), target, coat)
