"""An export: the record, what was asked for, and the manifest."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tbcad.background import Submit, background_process
from tbcad.cad.brep import InvalidSolidError
from tbcad.camera.sheet import write_camera_sheet
from tbcad.mirrors.array import MirrorDesign
from tbcad.mirrors.record import write_record
from tbcad.output.manifest import write_manifest
from tbcad.output.parts import PARTS, PROTOTYPE, SHELL
from tbcad.prototype.files.write import export_prototype
from tbcad.shell.files import shell_envelope, write_shells
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.types import Progress


@dataclass(frozen=True)
class Export:
    """What was written.

    Attributes:
        spec: the design's, with a value for every key that was chosen on the way.
        parts: some of PARTS.
        note: why a part was left out; empty when none was.
    """

    spec: Spec
    parts: tuple[str, ...]
    note: str = ""


def write_export(
    design: MirrorDesign,
    folder: Path,
    parts: Sequence[str] = PARTS,
    progress: Progress = lambda _: None,
    *,
    optional_prototype: bool = False,
) -> Export:
    """Write an export into an empty folder.

    Args:
        design: the mirrors.
        folder: to write into.
        parts: some of PARTS.
        progress: called with each stage.
        optional_prototype: leave the prototype out where it cannot be made, instead of refusing.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    if PROTOTYPE not in parts:
        write_shells(design, folder, progress)
        export = Export(design.spec, (SHELL,))
    elif SHELL not in parts:
        with background_process() as submit:
            export = Export(export_prototype(design, folder, progress, submit), (PROTOTYPE,))
    else:
        shell_envelope(design)  # refuses flanges that do not fit before anything is built
        with background_process() as submit:
            submit(write_shells, design, folder)
            export = _prototype_with_shells(design, folder, progress, submit, optional_prototype)
            progress("shells")
    radius = design.spec.optics.capture_diameter_mm / 2
    write_camera_sheet(folder, design.arrays[0], radius)
    write_record(folder, replace(design, spec=export.spec), SHELL in parts)
    progress("manifest")
    write_manifest(folder)
    return export


def _prototype_with_shells(
    design: MirrorDesign, folder: Path, progress: Progress, submit: Submit, optional: bool
) -> Export:
    try:
        return Export(export_prototype(design, folder, progress, submit), PARTS)
    except (SpecError, InvalidSolidError) as error:
        if optional:
            return Export(design.spec, (SHELL,), f"no prototype: {error}")
        if isinstance(error, SpecError):
            raise SpecError(f"{error}; or leave the prototype out with --parts shell") from None
        raise
