"""Files from a spec, verified."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from tbcad.app.api.designs import chosen_spec
from tbcad.app.api.verification import verification
from tbcad.common.atomic_files import InFolder
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import option_texts
from tbcad.errors import InputError
from tbcad.options.builds import (
    DEFAULT_YIELD,
    BuildOptions,
    ReportOptions,
    VerificationOptions,
    check_yield,
)
from tbcad.options.call import keywords, silent
from tbcad.options.checks import check_is_capture, check_is_export, check_is_folder

if TYPE_CHECKING:
    from tbcad_verify.report.as_made import AsMade, ProcessYield
    from tbcad_verify.report.report import Report

    from tbcad.app.whole_design import Design
    from tbcad.core.mirrors.array import MirrorDesign
    from tbcad.tolerancing.process.process import Process
    from tbcad.types import Progress


@dataclass(frozen=True)
class Build(InFolder):
    """Files and results of a build.

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


@dataclass(frozen=True)
class BuildPlan:
    """A build that can be begun."""

    spec: Spec  # as asked for, before a process changes it
    # that are built, but no prototype where it is not asked for and cannot be
    parts: tuple[str, ...]
    process: Process | None  # that edges and margins are chosen for


def planned(options: BuildOptions) -> BuildPlan:
    """Refuse, before any work, what cannot be built or replaced."""
    from tbcad.common.reuse import check_is_apart
    from tbcad.output.folder import check_replaceable
    from tbcad.output.parts import (
        check_is_used,
        check_lists,
        check_parts,
        default_parts,
        parse_parts,
    )
    from tbcad.output.single_files import design_files, files_named

    asked = parse_parts(options.parts) if isinstance(options.parts, str) else options.parts
    changes = option_texts(options.settings)
    changes += [f"mirrors.radius_rule={options.radius_rule}"] if options.radius_rule else []
    spec = chosen_spec(options.spec, options.n, changes)
    process = _asked_process(options)
    if asked is not None:
        check_parts(spec, asked)
    parts = default_parts(spec) if asked is None else tuple(asked)
    check_is_used(spec, parts)
    check_lists(spec, parts)
    file = None if isinstance(options.spec, Spec) else options.spec
    inputs = [*design_files(spec, file), *files_named(options.process)]
    check_replaceable(Path(options.out), "build", options.force, inputs)
    check_is_apart(Path(options.out))
    return BuildPlan(spec, parts, process)


@keywords(BuildOptions)
def build(options: BuildOptions) -> Build:
    """Compute the mirrors, write all files into a folder, verify them, and write report.html.

    The folder is replaced atomically. A design may also be a spec.

    Raises:
        InputError: the folder cannot be replaced, or the spec is not allowed; nothing is written.
    """
    return build_planned(planned(options), options)


def build_planned(plan: BuildPlan, options: BuildOptions) -> Build:
    """Build what was planned by the same options; `InputError` as of `build`."""
    from tbcad.common.reuse import reusing

    started, plan = monotonic(), replace(plan, spec=spec_for_process(plan, options))
    options.progress("mirrors: radii and cells")
    with reusing(options.fresh, options.answer):
        finished = _build_files(plan, options)
    if finished.report is None:
        return finished
    return replace(finished, report=replace(finished.report, seconds=monotonic() - started))


def _asked_process(options: BuildOptions) -> Process | None:
    """The process whose margins are wanted: checked before anything takes long."""
    from tbcad.tolerancing.process.process import load_process

    if options.wanted_yield is not None:
        if options.process is None:
            raise InputError(
                f"--yield {options.wanted_yield:g} is of no use without --process: name a "
                "process, or leave --yield out"
            )
        check_yield(options.wanted_yield)
    return None if options.process is None else load_process(options.process)


def spec_for_process(plan: BuildPlan, options: BuildOptions) -> Spec:
    """The design with edges and margins for its process; the answer says what they cost."""
    spec, process = plan.spec, plan.process
    if process is None:
        return spec
    from tbcad.tolerancing.process_design import (
        costs_text,
        edges_for_process,
        edges_text,
        margins_text,
        pixel_costs,
        ssim_costs,
        ssim_text,
    )

    options.progress(f"edges and margins for {process.name}")
    wanted = DEFAULT_YIELD if options.wanted_yield is None else options.wanted_yield
    choice = edges_for_process(spec, process, wanted, options.detail)
    found = choice.made
    options.answer(edges_text(choice))
    options.answer(f"{margins_text(found)}, for {wanted:.1%} by {process.name}")
    options.detail("pixels")
    options.answer(costs_text(pixel_costs(found, choice.pixels)))
    options.detail("views")
    options.answer(ssim_text(ssim_costs(found)))
    return found.spec


def _build_files(plan: BuildPlan, options: BuildOptions) -> Build:
    """Write all files, verify them, write report.html, and replace the folder.

    The files are read back before they replace the old ones.
    """
    from tbcad_verify.report.as_made import AsMade
    from tbcad_verify.run.processes import Processes, load

    from tbcad.common.schedule import background_work
    from tbcad.output.folder import replacing

    out, verify, progress = Path(options.out), options.verify, options.progress
    with (
        Processes(1) as worker,
        Processes(1) as ready,
        replacing(out, "build", options.force) as folder,
    ):
        with background_work(worker) as submit:
            submit(_load_libraries)  # while the mirrors are computed here
            from tbcad.core.mirrors.array import design

            mirrors = design(plan.spec, options.detail)
            loading = ready.submit(load, "tbcad_verify.run.stages") if verify else None
            simulated = submit(_as_made, mirrors) if verify and "shell" in plan.parts else None
            from tbcad.output.build import write_export

            optional = options.parts is None
            export = write_export(
                mirrors, folder, plan.parts, progress, submit, optional_prototype=optional
            )
            printed = submit(_prototype_as_made, folder) if verify else None
        report = None
        if loading:
            loading.exception()  # of one that ended here the verification will tell
            cutter = plan.process.ball_mm if plan.process else None
            asked = VerificationOptions(folder, progress=progress, cutter=cutter)
            report = replace(
                verification(asked, worker, ready),  # the first has the kernel loaded
                folder=out,
                note=export.note,
                as_made=replace(
                    simulated.result() if simulated else AsMade(),
                    prototype=printed.result() if printed else None,
                ),
            )
        progress("report")
        from tbcad.report.page.write import write_report

        write_report(folder, as_made=report.as_made if report else None)
    from tbcad.app.whole_design import Design

    return Build(out, Design(export.spec, mirrors.arrays), export.parts, export.note, report)


def _load_libraries() -> None:
    """Load what the background process works with."""
    import tbcad.tolerancing.as_made  # noqa: F401


def _as_made(mirrors: MirrorDesign) -> AsMade:
    """Simulate a few builds of a design by every built-in process."""
    from tbcad.light.simulate.scene.reflector import reflectors
    from tbcad.tolerancing.as_made import as_made

    return as_made(reflectors(mirrors), mirrors.spec)


def _prototype_as_made(folder: Path) -> ProcessYield | None:
    """Simulate a few prototypes of a build, printed and calibrated.

    None where there is none, or its files cannot be read: the verification says what is wrong.
    """
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.records.prototype import NAME
    from tbcad.tolerancing.as_made import prototype_as_made

    if not (folder / NAME).is_file():
        return None
    try:
        return prototype_as_made(read_export(folder))
    except InputError:
        return None


def as_made(
    exports: Path | str, progress: Progress = silent, detail: Progress = silent
) -> AsMade | None:
    """Simulate a few builds of a folder's shells by every built-in process, and of its prototype.

    None where its record cannot be read.
    """
    from tbcad_verify.report.as_made import AsMade

    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.tolerancing.as_made import as_made as simulated

    folder = Path(exports)
    progress("simulated builds by each process")
    try:
        export = read_export(folder)
    except InputError:  # the verification says what is wrong with it
        return None
    shells = (folder / "shell_a.stl").is_file()
    found = simulated(export.reflectors, export.spec, detail) if shells else AsMade()
    return replace(found, prototype=_prototype_as_made(folder))


@keywords(ReportOptions)
def report_page(options: ReportOptions) -> Path:
    """Write the page that shows a build: one HTML file with its verdict, 3D view and tables.

    InputError: the build or the capture cannot be read, or the file may not be written.
    """
    folder = Path(options.exports)
    file, light_field = (
        None if one is None else Path(one) for one in (options.out, options.capture)
    )
    check_is_folder(folder)
    check_is_export(folder)
    if light_field is not None:
        check_is_capture(light_field)
    from tbcad.report.page.write import check_writable, write_report

    check_writable(file or folder / "report.html", options.force)
    simulated = as_made(folder, options.progress, options.detail)
    options.progress("report")
    return write_report(folder, file, simulated, light_field, force=options.force)
