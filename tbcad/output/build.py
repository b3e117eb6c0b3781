"""An export: the record, what was asked for, and the manifest."""

from collections.abc import Sequence
from pathlib import Path

from tbcad.mirrors.array import MirrorDesign
from tbcad.mirrors.record import write_record
from tbcad.output.background import in_background
from tbcad.output.manifest import write_manifest
from tbcad.output.parts import PARTS, PROTOTYPE, SHELL
from tbcad.prototype.files.write import export_prototype
from tbcad.shell.files import shell_envelope, write_shells
from tbcad.spec.errors import SpecError
from tbcad.types import Progress


def write_export(
    design: MirrorDesign,
    folder: Path,
    parts: Sequence[str] = PARTS,
    progress: Progress = lambda _: None,
) -> None:
    """Write an export into an empty folder.

    Args:
        design: the mirrors.
        folder: to write into.
        parts: some of PARTS.
        progress: called with each stage.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    write_record(folder, design, SHELL in parts)
    if PROTOTYPE not in parts:
        write_shells(design, folder, progress)
    elif SHELL not in parts:
        export_prototype(design, folder, progress)
    else:
        shell_envelope(design)  # refuses flanges that do not fit before anything is built
        with in_background(write_shells, design, folder):
            try:
                export_prototype(design, folder, progress)
            except SpecError as error:
                raise SpecError(f"{error}; or leave the prototype out with --parts shell") from None
            progress("shells")
    progress("manifest")
    write_manifest(folder)
