"""The verification, whose errors become those of tbcad, and how exactly a design must be made."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.core.spec.load import option_texts
from tbcad.errors import InputError
from tbcad.options.builds import (
    OrderOptions,
    ToleranceOptions,
    VerificationOptions,
    check_yield,
)
from tbcad.options.call import keywords, silent
from tbcad.options.checks import check_is_export, check_is_object

if TYPE_CHECKING:
    from tbcad_verify.as_built.verify import AsBuiltReport
    from tbcad_verify.report.report import Report
    from tbcad_verify.run.processes import Processes

    from tbcad.tolerancing.analysis import Analysis
    from tbcad.tolerancing.process.process import Process
    from tbcad.types import Progress


@keywords(VerificationOptions)
def verify(options: VerificationOptions) -> Report:
    """Verify the files of a build with code that shares nothing with the code that wrote them.

    Returns:
        The report; `report.passed` is the verdict. It is written to verify.json too.

    Raises:
        InputError: the folder is no readable build.
    """
    options.check()
    return verification(options)


def verification(
    options: VerificationOptions, idle: Processes | None = None, ready: Processes | None = None
) -> Report:
    """The same; `idle` and `ready` are as `tbcad_verify` takes them."""
    from tbcad_verify.errors import BadExport
    from tbcad_verify.run.verify import VerifyOptions
    from tbcad_verify.run.verify import verify as verify_files

    limit, printers = options.time_limit, tuple(options.printers)
    asked = VerifyOptions(
        seconds=limit,
        printers=printers,
        clients=options.clients,
        strict=options.strict,
        cutter_mm=options.cutter,
    )
    try:
        return verify_files(
            Path(options.exports),
            lambda name: options.progress(f"verification: {name}"),
            asked,
            idle,
            ready,
        )
    except BadExport as error:
        raise InputError(str(error)) from None


def verify_as_built(
    exports: Path | str, calibration: Path | str, *, progress: Progress = silent
) -> AsBuiltReport:
    """Verify the prototype of a build as a calibration found it: coverage, and what to shim.

    InputError: one cannot be read, or they do not belong together. Nothing is written.
    """
    from tbcad_verify.as_built.verify import verify_as_built as verify_machine
    from tbcad_verify.errors import BadExport

    try:
        return verify_machine(Path(exports), Path(calibration), progress)
    except BadExport as error:
        raise InputError(str(error)) from None


LEAST_BUILDS = 10  # of random ones


@keywords(ToleranceOptions)
def tolerance(options: ToleranceOptions) -> Analysis:
    """Simulate many builds by a manufacturing process, and find what limits their yield.

    Raises:
        InputError: build or process cannot be read, or mirrors are planar.
    """
    process, exports = checked_process(options), Path(options.exports)
    from tbcad.common.schedule import one_client
    from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.tolerancing.analysis import analyse as analyse_export

    options.progress("record of the build")
    export = read_export(exports)
    taken = ObjectOptions(up=options.up, unit=options.unit)
    subject = load_object(options.object_file, export.capture_mm, taken, options.answer)
    with one_client(options.scheduler):
        return analyse_export(export, process, subject, options)


analyse = tolerance  # as it was called at first


def checked_process(options: ToleranceOptions) -> Process:
    """The process, when all that can be refused at once has been."""
    from tbcad.tolerancing.process.process import DEFAULT_PROCESS, load_process

    name = DEFAULT_PROCESS if options.process is None else options.process
    process = load_process(name, option_texts(options.settings))
    if options.builds < LEAST_BUILDS:
        raise InputError(f"--builds {options.builds}: allowed is {LEAST_BUILDS} to 1000000")
    check_yield(options.wanted_yield)
    check_is_export(Path(options.exports))
    check_is_object(options.object_file, options.up, options.unit)
    return process


@keywords(OrderOptions)
def order(options: OrderOptions) -> dict[str, Any]:
    """Write what a workshop needs to make the shells of a build by a process chain; order.json.

    Limits of each mirror's errors and what the chain holds of them: tables, STEP with tolerances,
    and a page for the rest. InputError: the build has no shells, or no mandrels that the
    chain needs, their mirrors are planar or have no margin, the chain cannot be read, the
    share is not between 0 and 1, or out cannot be replaced.
    """
    exports, out = Path(options.exports), Path(options.out)
    check_is_export(exports)
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest
    from tbcad.tolerancing.process.process import load_process

    check_yield(options.wanted)
    process = load_process(options.process)
    check_replaceable(out, "order", options.force, (exports,))
    from tbcad.drawings.order_sheet import write_sheet
    from tbcad.mirror_limits.order import checked_export, write_order

    export = checked_export(exports, process, options.process)
    with replacing(out, "order", options.force, (exports,)) as folder:
        record = write_order(export, process, options, folder)
        options.progress("page")
        write_sheet(folder, exports, record, export.spec)
        write_manifest(folder, "order")
    return record
