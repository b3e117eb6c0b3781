"""What a command reads and what it writes are apart; single files that are written."""

from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import TypeAlias

from tbcad.common.atomic_files import refuse_existing, write_errors_as_input_errors
from tbcad.core.spec.design import Spec
from tbcad.errors import InputError
from tbcad.output.manifest import MANIFEST, VERDICT, kind_of, read_manifest, refuse_inside, words

Source: TypeAlias = str | PathLike[str] | None
"""A file or folder that a command reads; None, and what is not there, are left out."""

_Place: TypeAlias = tuple[int, int]


def refuse_inputs(out: Path, inputs: Iterable[Source]) -> None:
    """Refuse, before any work, an output that is an input, is inside one, or has one inside.

    Files are compared by device and inode, so by whatever name and link they are called.
    """
    target = out.resolve()
    above = _places(target)
    for source in inputs:
        path = None if source is None else Path(source)
        if path is None or not path.exists():
            continue
        place, *outer = _places(path.resolve())
        if target.exists() and place == above[0]:
            raise InputError(f"{out} is read by this command: write to another place with --out")
        if place in above:
            raise InputError(
                f"{out} is inside {path}, which this command reads: write to a place outside it"
            )
        if target.exists() and above[0] in outer:
            raise InputError(
                f"{out} holds {path}, which this command reads: write to another folder"
            )


def files_named(*texts: Source) -> list[Path]:
    """Return the files among texts that may also be words, as a built-in process or "mirrors"."""
    return [Path(text) for text in texts if text is not None and Path(text).is_file()]


def design_files(spec: Spec, file: Source) -> list[Path]:
    """Return the files that a design is read from: its own, catalogues and prices."""
    return files_named(file, *spec.prototype.catalogues, *spec.prototype.prices)


def _places(path: Path) -> list[_Place]:
    """Return device and inode of a path and of all folders above it, those that exist."""
    found = [one.stat() for one in (path, *path.parents) if one.exists()]
    return [(one.st_dev, one.st_ino) for one in found]


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
    """Refuse, before any work, to write tables and plots into what tbcad wrote as a whole."""
    with write_errors_as_input_errors(out):
        refuse_inside(out, out.resolve() / "table")


def refuse_member(file: Path) -> None:
    """Refuse a file of a build, a capture ...: another in its place would spoil the whole."""
    place = file.parent.resolve() / file.name
    for folder in place.parents:
        kind = kind_of(folder)
        if kind is None:
            continue
        manifest = read_manifest(folder)
        names = {*manifest.files, MANIFEST, VERDICT} if manifest else set[str]()
        if place.relative_to(folder).as_posix() in names or (kind == "run" and place.exists()):
            raise InputError(f"{file} belongs to {folder}, {words(kind)}: choose another name")
