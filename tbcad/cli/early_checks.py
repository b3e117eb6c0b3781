"""What is refused before the heavy libraries are loaded: an answer at once where input is bad.

The checks are those of the readers, who make them again.
"""

from collections.abc import Sequence
from pathlib import Path

from tbcad.errors import InputError

DESIGN_FILE = "design.json"
LIGHT_FIELD_FILE = "lightfield.h5"


def check_is_folder(folder: Path) -> None:
    """Refuse what is no folder.

    Raises:
        InputError: it is none.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder that `tbcad build` wrote")


def check_is_export(folder: Path) -> None:
    """Refuse a folder without the record of a design.

    Raises:
        InputError: it has none.
    """
    path = folder / DESIGN_FILE
    if not path.is_file():
        raise InputError(f"{path} is not there: name a folder that tbcad build wrote")


def check_is_object(path: Path | None) -> None:
    """Refuse a mesh that is no file; without one the built-in object is taken.

    Raises:
        InputError: it is none.
    """
    if path is not None and not path.is_file():
        raise InputError(f"{path} is no file: name a triangle mesh (PLY, STL, OBJ, GLB ...)")


def check_are_printers(names: Sequence[str]) -> None:
    """Refuse profiles that cannot be used.

    Raises:
        InputError: one is neither built in nor a good file.
    """
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
    """Refuse what holds no light field.

    Raises:
        InputError: it is neither a file nor a folder with one.
    """
    file = path / LIGHT_FIELD_FILE if path.is_dir() else path
    if not file.is_file():
        raise InputError(f"{file} is no file: name a folder that tbcad capture wrote")
