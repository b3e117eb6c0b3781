"""What is refused before the heavy libraries are loaded: an answer at once where input is bad.

The checks are those of the readers, who make them again.
"""

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


def check_is_capture(path: Path) -> None:
    """Refuse what holds no light field.

    Raises:
        InputError: it is neither a file nor a folder with one.
    """
    file = path / LIGHT_FIELD_FILE if path.is_dir() else path
    if not file.is_file():
        raise InputError(f"{file} is no file: name a folder that tbcad capture wrote")
