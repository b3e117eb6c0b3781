"""How exactly a design must be made."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.core.spec.load import option_texts
from tbcad.errors import InputError
from tbcad.options.call import keywords
from tbcad.options.checks import check_is_export, check_is_object
from tbcad.options.tolerances import InspectionOptions, ToleranceOptions, check_yield

if TYPE_CHECKING:
    from tbcad.tolerancing.analysis import Analysis
    from tbcad.tolerancing.process.process import Process

LEAST_BUILDS = 10  # of random ones


@keywords(ToleranceOptions)
def tolerance(options: ToleranceOptions) -> Analysis:
    """Simulate many builds by a manufacturing process, and find what limits their yield.

    Raises:
        InputError: export or process cannot be read, or mirrors are planar.
    """
    process, exports = checked_process(options), Path(options.exports)
    from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_or_built_in
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.tolerancing.analysis import analyse as analyse_export
    from tbcad.tolerancing.stages import RECORD

    options.progress(RECORD)
    export = read_export(exports)
    taken = ObjectOptions(up=options.up, unit=options.unit)
    subject = load_or_built_in(options.object_file, export.capture_mm, taken, options.answer)
    return analyse_export(export, process, subject, options)


analyse = tolerance  # as it was called at first


def checked_process(options: ToleranceOptions) -> Process:
    """The process, when all that can be refused at once has been."""
    from tbcad.tolerancing.process.process import DEFAULT_PROCESS, load_process

    process = load_process(options.process or DEFAULT_PROCESS, option_texts(options.settings))
    if options.builds < LEAST_BUILDS:
        raise InputError(f"--builds {options.builds}: allowed is {LEAST_BUILDS} to 1000000")
    check_yield(options.wanted_yield)
    check_is_export(Path(options.exports))
    file = options.object_file
    check_is_object(None if file is None else Path(file), options.up, options.unit)
    return process


@keywords(InspectionOptions)
def inspect(options: InspectionOptions) -> dict[str, Any]:
    """Write by how much each mirror of a shell may be off: tables, and STEP with tolerances.

    Returns:
        What is in inspection.json.

    Raises:
        InputError: the export has no shells, their mirrors are planar or may not be off at all,
            the share is not between 0 and 1, or out cannot be replaced.
    """
    exports, out = Path(options.exports), Path(options.out)
    check_is_export(exports)
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest

    check_yield(options.wanted)
    check_replaceable(out, "inspection", options.force, (exports,))
    from tbcad.mirror_limits.inspect import checked_export
    from tbcad.mirror_limits.inspect import inspect as write_files

    export = checked_export(exports)
    with replacing(out, "inspection", options.force, (exports,)) as folder:
        record = write_files(export, options.wanted, folder, options.progress)
        write_manifest(folder, "inspection")
    return record
