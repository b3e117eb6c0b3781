"""Files from a spec, verified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from tbcad.api.arguments import chosen_spec
from tbcad.api.verification import verify as verification
from tbcad.atomic_files import InFolder
from tbcad.errors import InputError
from tbcad.options.call import silent
from tbcad.spec.design import Spec

if TYPE_CHECKING:
    from tbcad_verify.report.as_made import AsMade
    from tbcad_verify.report.report import Report

    from tbcad.mirrors.array import MirrorDesign
    from tbcad.types import Progress
    from tbcad.whole_design import Design


@dataclass(frozen=True)
class Build(InFolder):
    """What a build wrote.

    Attributes:
        folder: that holds all files.
        design: the mirrors.
        parts: what was built: "shell", "prototype" or both.
        note: why the prototype was left out; empty when it was not.
        report: the verification of the files; None when it was not asked for.
    """

    folder: Path
    design: Design
    parts: tuple[str, ...]
    note: str
    report: Report | None

    def __repr__(self) -> str:
        """Return folder and verdict."""
        verdict = "not verified" if self.report is None else self.report.verdict
        return f"<Build {self.folder}: {' and '.join(self.parts)}; {verdict}>"

    @property
    def passed(self) -> bool:
        """Whether the files are verified and pass every check."""
        return self.report is not None and self.report.passed


def build(
    spec: Spec | Path | str | None = None,
    out: Path | str = "exports",
    *,
    parts: Sequence[str] | None = None,
    verify: bool = True,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> Build:
    """Compute the mirrors, write all files into a folder, verify them, and write report.html.

    The folder is replaced as a whole or not at all.

    Args:
        spec: a spec, a design file (TOML), or None for the design of the paper.
        out: folder to write.
        parts: "shell", "prototype" or both; None: both, but no prototype where none can be made.
        verify: verify the files before they replace those of an earlier build.
        force: replace a build that a run photographed, and keep files that tbcad did not write.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Raises:
        InputError: the folder cannot be replaced, or the spec is not allowed; nothing is written.
    """
    from tbcad.output.folder import check_replaceable
    from tbcad.output.inputs import design_files
    from tbcad.output.parts import check_lists, default_parts

    chosen, out = chosen_spec(spec, None, ()), Path(out)
    asked = tuple(parts) if parts is not None else default_parts(chosen)
    inputs = design_files(chosen, None if isinstance(spec, Spec) else spec)
    check_replaceable(out, "build", force, inputs)
    check_lists(chosen, asked)
    started = monotonic()
    progress("mirrors: radii and cells")
    finished = _build_files(chosen, out, asked, verify, force, parts is None, progress, detail)
    if finished.report is None:
        return finished
    return replace(finished, report=replace(finished.report, seconds=monotonic() - started))


def _build_files(
    spec: Spec,
    out: Path,
    parts: Sequence[str],
    verify: bool,
    force: bool,
    optional_prototype: bool,
    progress: Progress,
    detail: Progress,
) -> Build:
    """Write all files, verify them, write report.html, and replace the folder.

    The files are read back before they replace the old ones.
    """
    from tbcad.background import background_processes
    from tbcad.output.folder import replacing

    with replacing(out, "build", force) as folder:
        with background_processes() as submit:
            submit(_load_libraries)  # while the mirrors are computed here
            from tbcad.mirrors.array import design

            mirrors = design(spec, detail)
            simulated = submit(_as_made, mirrors) if verify and "shell" in parts else None
            from tbcad.output.build import write_export

            export = write_export(
                mirrors, folder, parts, progress, submit, optional_prototype=optional_prototype
            )
        report = None
        if verify:
            report = replace(
                verification(folder, progress=progress),
                folder=out,
                note=export.note,
                as_made=simulated.result() if simulated else None,
            )
        progress("report")
        from tbcad.report.page.write import write_report

        write_report(folder, as_made=report.as_made if report else None)
    from tbcad.whole_design import Design

    return Build(out, Design(export.spec, mirrors.arrays), export.parts, export.note, report)


def _load_libraries() -> None:
    """Load what the background process works with."""
    import tbcad.tolerancing.as_made  # noqa: F401


def _as_made(mirrors: MirrorDesign) -> AsMade:
    """Simulate a few builds of a design by every built-in process."""
    from tbcad.simulate.scene.reflector import reflectors
    from tbcad.tolerancing.as_made import as_made

    spec = mirrors.spec
    target, coat = spec.optics.capture_diameter_mm, spec.mirrors.coating_um
    return as_made(reflectors(mirrors), target, coat)


def as_made(
    exports: Path | str, progress: Progress = silent, detail: Progress = silent
) -> AsMade | None:
    """Simulate a few builds of an export by every built-in process.

    Returns:
        Their yields; None where no shell was built, or its record cannot be read.
    """
    from tbcad.simulate.scene.exported import read_export
    from tbcad.tolerancing.as_made import as_made as simulated

    folder = Path(exports)
    if not (folder / "shell_a.stl").is_file():
        return None
    progress("simulated builds by each process")
    try:
        export = read_export(folder)
    except InputError:  # the verification says what is wrong with it
        return None
    coat = export.spec.mirrors.coating_um
    return simulated(export.reflectors, export.capture_mm, coat, detail)


def report_page(
    exports: Path | str,
    out: Path | str | None = None,
    *,
    capture: Path | str | None = None,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> Path:
    """Write the page that shows an export: one HTML file with its verdict, 3D view and tables.

    Args:
        exports: folder that `build` wrote.
        out: file to write; None: report.html in the folder.
        capture: folder that `capture` or `merge` wrote for this export; the page then shows what
            each mirror photographs.
        force: replace a file that tbcad did not write, instead of refusing.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        The file.

    Raises:
        InputError: the export or the capture cannot be read, or the file may not be written.
    """
    from tbcad.report.page.write import check_writable, write_report

    folder, file = Path(exports), Path(out) if out is not None else None
    check_writable(file or folder / "report.html", force)
    simulated = as_made(folder, progress, detail)
    progress("report")
    light_field = None if capture is None else Path(capture)
    return write_report(folder, file, simulated, light_field, force=force)
