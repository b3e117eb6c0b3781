"""How exactly a design must be made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.api.arguments import Settings
from tbcad.options.call import keywords, silent
from tbcad.options.checks import check_is_export
from tbcad.options.tolerances import InspectionOptions
from tbcad.spec.load import option_texts

if TYPE_CHECKING:
    from tbcad.simulate.object_files.contents import Up
    from tbcad.simulate.scene.object_from_file import Unit
    from tbcad.tolerancing.analysis import Analysis
    from tbcad.tolerancing.options import ToleranceOptions
    from tbcad.types import Progress


def analyse(
    exports: Path | str,
    process: str | None = None,
    object_file: Path | str | None = None,
    *,
    up: Up | None = None,
    unit: Unit | None = None,
    settings: Settings = (),
    options: ToleranceOptions | None = None,
    progress: Progress = silent,
    detail: Progress = silent,
    answer: Progress = silent,
) -> Analysis:
    """Simulate many builds by a manufacturing process, and find what limits their yield.

    Args:
        exports: folder that `build` wrote.
        process: "fdm", "sls", "sla", "cnc", "diamond", or a TOML file; by default "sla", and the
            yields of all built-in processes are compared.
        object_file: mesh that is photographed for the sharpness; None for a built-in knot.
        up: axis of that file that points up, "y" or "z"; None: y for glTF, else z.
        unit: of that file, "mm", "cm", "m" or "in"; None: m for glTF, what a 3MF says, else mm.
        settings: "kind=value" texts that change errors of the process.
        options: number of builds, wanted yield, seed, whether margins are searched for ...
        progress: called with the name of each stage.
        detail: called with the state of a stage.
        answer: called with how the object's file was taken, and with the yield as soon as it is
            known, in words.

    Raises:
        InputError: export or process cannot be read, or mirrors are planar.
    """
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.object_from_file import ObjectOptions, load_or_built_in
    from tbcad.tolerancing.analysis import analyse as analyse_export
    from tbcad.tolerancing.options import ToleranceOptions
    from tbcad.tolerancing.process.process import DEFAULT_PROCESS, load_process
    from tbcad.tolerancing.stages import RECORD

    asked = options or ToleranceOptions()
    asked = asked if process else replace(asked, every_process=True)
    made_by = load_process(process or DEFAULT_PROCESS, option_texts(settings))
    progress(RECORD)
    export = read_export(Path(exports))
    options_of_object = ObjectOptions(up=up, unit=unit)
    subject = load_or_built_in(object_file, export.capture_mm, options_of_object, answer)
    return analyse_export(export, made_by, subject, asked, progress, detail, answer)


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
    from tbcad.tolerancing.options import check_yield

    check_yield(options.wanted)
    check_replaceable(out, "inspection", options.force, (exports,))
    from tbcad.mirror_limits.inspect import checked_export
    from tbcad.mirror_limits.inspect import inspect as write_files

    export = checked_export(exports)
    with replacing(out, "inspection", options.force, (exports,)) as folder:
        record = write_files(export, options.wanted, folder, options.progress)
        write_manifest(folder, "inspection")
    return record
