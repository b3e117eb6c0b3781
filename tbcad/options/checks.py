"""What is refused before the heavy libraries are loaded: an answer at once where input is bad.

The checks are those of the readers, who make them again.
"""

from collections.abc import Sequence
from pathlib import Path

from tbcad.errors import InputError
from tbcad.options.shared import AnyPath

DESIGN_FILE = "design.json"
LIGHT_FIELD_FILE = "lightfield.h5"
FIELD_FILE = "field.npz"
RUN_FILE = "run.json"
MACHINE_FILE = "machine.json"
CALIBRATION_FILE = "calibration.json"
SHELL_CAMERAS = ("a", "b")  # folders of a shell's calibration


def check_is_folder(folder: Path) -> None:
    """Refuse what is no folder; InputError: it is none."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder that `tbcad build` wrote")


def check_is_export(folder: Path) -> None:
    """Refuse a folder without the record of a design; InputError: it has none."""
    _check_has(folder, DESIGN_FILE, "build")


def _check_has(folder: Path, file: str, writer: str) -> None:
    if not (folder / file).is_file():
        raise InputError(f"{folder / file} is not there: name a folder that tbcad {writer} wrote")


def check_is_object(path: AnyPath | None, up: str | None, unit: str | None) -> None:
    """Refuse a mesh that is no file; without one the built-in object is taken.

    InputError: it is none, or its axis or unit is given without it.
    """
    if path is None and (up or unit):
        raise InputError("--up and --unit are of a file: give --object too, or leave them out")
    if path is not None and not Path(path).is_file():
        raise InputError(f"{path}: no such file; give a triangle mesh (PLY, STL, OBJ, GLB ...)")


def check_are_printers(names: Sequence[str]) -> None:
    """Refuse profiles that cannot be used; InputError: one is neither built in nor a good file."""
    if not names:
        return
    from tbcad_verify.errors import BadExport
    from tbcad_verify.printing.profile import load

    for name in names:
        try:
            load(name)
        except BadExport as error:
            raise InputError(str(error)) from None


def check_is_capture(path: Path) -> None:
    """Refuse what holds no light field; InputError: it is neither a file nor a folder with one."""
    file = path / LIGHT_FIELD_FILE if path.is_dir() else path
    if not file.is_file():
        raise InputError(
            f"{file}: no such file; give a light field: the folder that `tbcad capture` or "
            "`tbcad merge` wrote, or its lightfield.h5"
        )


def check_is_run(folder: Path) -> None:
    """Refuse a folder without the record of a run; InputError: it has none."""
    _check_has(folder, RUN_FILE, "run or simulate-run")


def check_is_calibration(folder: Path) -> None:
    """Refuse a folder without a calibrated prototype; InputError: it has none."""
    if any((folder / one / MACHINE_FILE).is_file() for one in SHELL_CAMERAS) or _is_of_shell(
        folder
    ):
        raise InputError(
            f"{folder} is the calibration of a shell, which only tbcad merge takes: name that of a "
            "prototype"
        )
    _check_has(folder, MACHINE_FILE, "calibrate")


def check_is_any_calibration(folder: Path) -> None:
    """Refuse a folder without a calibrated prototype or shell; InputError: it has neither."""
    if not any((folder / one / MACHINE_FILE).is_file() for one in SHELL_CAMERAS):
        _check_has(folder, MACHINE_FILE, "calibrate")


def _is_of_shell(folder: Path) -> bool:
    """Whether a calibration's record says that it is of one camera of a shell."""
    from tbcad.cad.formats.checked_files import parse_json

    file = folder / CALIBRATION_FILE
    try:
        record = parse_json(file.read_text(encoding="utf-8")) if file.is_file() else None
    except (OSError, ValueError):
        return False  # its readers say so
    return isinstance(record, dict) and record.get("geometry") == "shell"
