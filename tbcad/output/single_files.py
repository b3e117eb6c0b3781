"""Files that a command writes beside others of the user: which may be replaced."""

from collections.abc import Iterable
from pathlib import Path

from tbcad.common.atomic_files import refuse_existing, write_errors_as_input_errors
from tbcad.errors import InputError
from tbcad.output.content import kind_of, refuse_inside, words
from tbcad.output.manifest import MANIFEST, VERDICT, read_manifest


def check_file(file: Path, force: bool, inputs: Iterable[Path | None] = ()) -> None:
    """Refuse, before any work, a file that must not be replaced, or not unasked.

    Args:
        file: to write.
        force: whether a file that exists may be replaced.
        inputs: files that the command reads, which stay even so.

    Raises:
        InputError: as said, or the file belongs to what tbcad wrote, or is a folder.
    """
    with write_errors_as_input_errors(file):
        if file.is_dir():
            raise InputError(f"{file} is a folder: choose another name")
        if file.exists():
            for source in inputs:
                if source is not None and source.exists() and source.samefile(file):
                    raise InputError(f"{file} is read by this command: choose another name")
        refuse_member(file)
        refuse_existing(file, force)


def check_tables(out: Path) -> None:
    """Refuse, before any work, to write tables and plots into what tbcad wrote as a whole.

    Raises:
        InputError: as said.
    """
    with write_errors_as_input_errors(out):
        refuse_inside(out, out.resolve() / "table")


def refuse_member(file: Path) -> None:
    """Refuse a file of a build, a capture ...: another in its place would spoil the whole.

    Raises:
        InputError: as said.
    """
    place = file.parent.resolve() / file.name
    for folder in place.parents:
        kind = kind_of(folder)
        if kind is None:
            continue
        manifest = read_manifest(folder)
        names = {*manifest.files, MANIFEST, VERDICT} if manifest else set[str]()
        if place.relative_to(folder).as_posix() in names or (kind == "run" and place.exists()):
            raise InputError(f"{file} belongs to {folder}, {words(kind)}: choose another name")
