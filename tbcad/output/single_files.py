"""Files of the user: those a command reads stay, single ones it writes, foreign ones it keeps."""

import errno
import os
import re
import shutil
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from itertools import chain, count
from os import PathLike
from pathlib import Path
from typing import TypeAlias

from tbcad.common.atomic_files import refuse_existing, write_errors_as_input_errors
from tbcad.core.spec.design import Spec
from tbcad.errors import InputError
from tbcad.output.manifest import (
    MANIFEST,
    REPORT,
    VERDICT,
    is_file,
    is_listed,
    is_report,
    kind_of,
    read_manifest,
    refuse_inside,
    words,
)

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


def check_file(
    file: Path, force: bool, inputs: Iterable[Path | None] = (), suffixes: Sequence[str] = ()
) -> None:
    """Refuse, before any work, a file that must not be replaced, or without force one that exists.

    Inputs are files that the command reads, which stay even so. With suffixes it has one of them,
    in a folder that exists.

    InputError as said, or the file belongs to what tbcad wrote, or is a folder.
    """
    with write_errors_as_input_errors(file):
        if suffixes and file.suffix.lower() not in suffixes:
            raise InputError(f"{file}: name a file that ends in {' or '.join(suffixes)}")
        if suffixes and not file.parent.is_dir():
            raise InputError(f"{file}: its folder does not exist: make it, or choose another")
        if file.is_dir():
            raise InputError(f"{file} is a folder: choose another name")
        if file.exists():
            for source in inputs:
                if source is not None and source.exists() and source.samefile(file):
                    raise InputError(f"{file} is read by this command: choose another name")
        refuse_member(file)
        refuse_existing(file, force)


def check_tables(out: Path) -> None:
    """Refuse, before any work, a folder for tables and plots that cannot be written.

    Nor may it be in what tbcad wrote as a whole; it need not exist.
    """
    with write_errors_as_input_errors(out):
        refuse_inside(out, out.resolve() / "table")
        absolute = out.absolute()
        existing = next(folder for folder in (absolute, *absolute.parents) if folder.exists())
        if not existing.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, f"{existing} is a file")
        if not os.access(existing, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, "no right to write there")


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


# Files that a checkout has in its folder of exports: no build writes them, and each keeps them.
ALWAYS_KEPT = (".gitignore", "README.md")
# What tbcad reconstruct writes beside a light field: of that alone, so it goes with it.
LIGHT_FIELD, FIELD_SCHEMA = "lightfield.h5", "tbcad-field"
_MAX_RECORD_BYTES = 100_000
FIELD = re.compile(r"field(-\d+)?\.npz|\.field(-\d+)?\.npz\.part")


def foreign_files(folder: Path) -> list[Path]:
    """Return the files and folders that tbcad did not write, sorted.

    tbcad wrote what manifest.json lists with the same size and sha256, manifest.json itself,
    verify.json, and report.html if it begins as tbcad's does; beside a light field also the field
    of it, under the name that it has by default, and its checkpoint. A folder all of whose files
    are listed in the same way is tbcad's; any other is the user's, as a whole.

    OSError: the folder cannot be read.
    """
    manifest = read_manifest(folder)
    of_tbcad = {MANIFEST, VERDICT} if manifest else set()
    if manifest and os.path.lexists(folder / REPORT) and is_report(folder / REPORT):
        of_tbcad.add(REPORT)
    listed = manifest.files if manifest else {}

    def is_of_tbcad(path: Path) -> bool:
        if path.is_dir() and not path.is_symlink() and not os.path.ismount(path):
            inner = list(path.iterdir())
            return bool(inner) and all(map(is_of_tbcad, inner))
        name = path.relative_to(folder).as_posix()
        if LIGHT_FIELD in listed and is_file(path) and _is_field(path):
            return True
        return is_file(path) and (name in of_tbcad or is_listed(path, listed.get(name)))

    return [path for path in sorted(folder.iterdir()) if not is_of_tbcad(path)]


def _is_field(path: Path) -> bool:
    """Tell a field, or the checkpoint of one, from any other file."""
    if not FIELD.fullmatch(path.name):
        return False
    member = "record.npy" if path.suffix == ".part" else "schema.npy"
    try:
        with zipfile.ZipFile(path) as packed, packed.open(member) as array:
            text = array.read(_MAX_RECORD_BYTES)
    except (OSError, KeyError, zipfile.BadZipFile, NotImplementedError, RuntimeError, zlib.error):
        return False
    return FIELD_SCHEMA.encode("utf-32-le") in text


def is_always_kept(path: Path) -> bool:
    """Tell whether a user's file is kept unasked."""
    return path.name in ALWAYS_KEPT and is_file(path)


def keep_files(paths: list[Path], into: Path) -> None:
    """Give files, links and folders a second place in another folder, as `.kept` where taken.

    InputError: a path is a mount point, or neither a file nor a link nor a folder; OSError: a file
    can neither be linked nor copied.
    """
    for path in paths:
        numbered = (f"{path.name}.kept{number}" for number in count(2))
        names = chain([path.name, f"{path.name}.kept"], numbered)
        to = next(into / name for name in names if not os.path.lexists(into / name))
        if path.is_dir() and not path.is_symlink():
            shutil.copytree(
                path, to, symlinks=True, ignore=_refuse_mount_point, copy_function=_link_or_copy
            )
        else:
            _link_or_copy(path, to)


def _refuse_mount_point(folder: str, _: list[str]) -> list[str]:
    """Ignore no file of a folder that is copied, but refuse to copy a mount point."""
    if os.path.ismount(folder):
        raise InputError(
            f"{folder} is a mount point, which cannot be kept: unmount it or move it out"
        )
    return []


def _link_or_copy(path: Path | str, to: Path | str) -> None:
    """Give a file a second name: what a program still writes into it is not lost."""
    try:
        os.link(path, to, follow_symlinks=False)
    except OSError:
        if not (os.path.islink(path) or is_file(Path(path))):
            raise InputError(f"{path} is no plain file and cannot be kept: move it out") from None
        shutil.copy2(path, to, follow_symlinks=False)
