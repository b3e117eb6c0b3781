"""The verification, whose errors become those of tbcad."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tbcad.errors import InputError
from tbcad.options.builds import VerificationOptions
from tbcad.options.call import keywords, silent

if TYPE_CHECKING:
    from tbcad_verify.as_built.verify import AsBuiltReport
    from tbcad_verify.report.report import Report

    from tbcad.types import Progress


@keywords(VerificationOptions)
def verify(options: VerificationOptions) -> Report:
    """Verify the files of a build with code that shares nothing with the code that wrote them.

    Returns:
        The report; `report.passed` is the verdict. It is written to verify.json too.

    Raises:
        InputError: the folder is no readable export.
    """
    options.check()
    from tbcad_verify.errors import BadExport
    from tbcad_verify.run.verify import VerifyOptions
    from tbcad_verify.run.verify import verify as verify_files

    limit, printers = options.time_limit, tuple(options.printers)
    asked = VerifyOptions(
        seconds=limit, printers=printers, clients=options.clients, strict=options.strict
    )
    try:
        return verify_files(
            Path(options.exports), lambda name: options.progress(f"verification: {name}"), asked
        )
    except BadExport as error:
        raise InputError(str(error)) from None


def verify_as_built(
    exports: Path | str, calibration: Path | str, *, progress: Progress = silent
) -> AsBuiltReport:
    """Verify the prototype of a build as a calibration found it: coverage, and what to shim.

    Args:
        exports: folder that `build` wrote.
        calibration: folder that `tbcad calibrate` wrote.
        progress: called with the name of each stage.

    Raises:
        InputError: one cannot be read, or they do not belong together. Nothing is written.
    """
    from tbcad_verify.as_built.verify import verify_as_built as verify_machine
    from tbcad_verify.errors import BadExport

    try:
        return verify_machine(Path(exports), Path(calibration), progress)
    except BadExport as error:
        raise InputError(str(error)) from None
