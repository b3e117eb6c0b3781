"""Files that are replaced together: all are written in full before the first takes its name."""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tbcad.errors import InputError


class InFolder:
    """What lies in a folder, such as a build or a run: wherever its path is wanted, it will do."""

    folder: Path

    def __fspath__(self) -> str:
        return str(self.folder)


def replace_files(folder: Path, contents: Mapping[str, bytes]) -> list[Path]:
    """Write files by name into a folder that exists, each replaced as a whole; others stay.

    InputError: the folder cannot be written; no temporary file is left in it.
    """
    with (
        write_errors_as_input_errors(folder),
        tempfile.TemporaryDirectory(dir=folder, prefix=".tbcad-") as temporary,
    ):
        for name, data in contents.items():
            Path(temporary, name).write_bytes(data)
        return [Path(temporary, name).replace(folder / name) for name in contents]


def refuse_existing(file: Path, force: bool) -> None:
    """Refuse, before any work, to replace a file that the user has not given up."""
    if file.exists() and not force:
        raise InputError(f"{file} exists: choose another name, or replace it with --force")


@contextmanager
def write_errors_as_input_errors(folder: Path) -> Iterator[None]:
    """Raise errors of the file system as an InputError that names the folder."""
    try:
        yield
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links, a null character
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{folder} cannot be written: {reason}: choose another folder") from error
