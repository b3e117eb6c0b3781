"""What a user has put into an output folder, and how it is kept when the folder is replaced."""

import json
import os
import re
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tbcad.errors import InputError
from tbcad.output.manifest import MANIFEST, VERDICT, fingerprint

_LARGEST_MANIFEST = 4_000_000  # bytes
_MANY_FILES = 10_000
_SHA256 = re.compile("[0-9a-f]{64}")


def foreign_files(folder: Path) -> list[Path]:
    """Return what stands in a folder that tbcad did not write, sorted.

    tbcad wrote what manifest.json lists with the same size and sha256, manifest.json itself and
    verify.json. It makes no folders, so each folder is the user's, as a whole.

    Raises:
        InputError: a folder inside is a mount point, which cannot be kept.
        OSError: the folder cannot be read.
    """
    listed = _listed(folder / MANIFEST)
    own = {MANIFEST, VERDICT} if listed is not None else set()
    return [
        path
        for path in sorted(folder.iterdir())
        if not (is_file(path) and (path.name in own or _is_listed(path, listed or {})))
    ]


def keep_files(paths: list[Path], into: Path) -> None:
    """Give files, links and folders a second place in another folder, as `.kept` where taken.

    Raises:
        OSError: a file can neither be linked nor copied.
    """
    for path in paths:
        _keep(path, into / _free_name(path.name, into))


def is_file(path: Path) -> bool:
    """Tell a plain file from folders, links and devices."""
    return stat.S_ISREG(path.lstat().st_mode)


def _is_listed(path: Path, listed: dict[str, dict[str, Any]]) -> bool:
    entry = listed.get(path.name)
    # The size first: it settles most without reading the file.
    return (
        entry is not None and entry["size"] == path.lstat().st_size and entry == fingerprint(path)
    )


def _listed(manifest: Path) -> dict[str, dict[str, Any]] | None:
    """Return the files of a manifest that tbcad can have written, None for any other."""
    try:
        if not is_file(manifest) or manifest.lstat().st_size > _LARGEST_MANIFEST:
            return None
        document = json.loads(manifest.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return document["files"] if _is_manifest(document) else None


def _is_manifest(document: object) -> bool:
    match document:
        case {"schema": str(schema), "files": dict(files)}:
            ours = schema.startswith("tbcad-manifest/") and len(files) <= _MANY_FILES
            return ours and all(_is_entry(*entry) for entry in files.items())
    return False


def _is_entry(name: str, entry: object) -> bool:
    match entry:
        case {"sha256": str(digest), "size": int(size), **others}:
            plain = not re.search(r"[/\\\0]", name) and name not in ("", ".", "..")
            counted = not isinstance(size, bool) and size >= 0
            return plain and not others and counted and bool(_SHA256.fullmatch(digest))
    return False


def _free_name(name: str, folder: Path) -> str:
    return next(free for free in _names(name) if not os.path.lexists(folder / free))


def _names(name: str) -> Iterator[str]:
    yield name
    yield f"{name}.kept"
    number = 2
    while True:
        yield f"{name}.kept{number}"
        number += 1


def _keep(path: Path, to: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        _keep_folder(path, to)
        return
    try:
        # A second name of the same file: what a program still writes into it is not lost.
        os.link(path, to, follow_symlinks=False)
    except OSError:
        _copy(path, to)


def _keep_folder(path: Path, to: Path) -> None:
    if os.path.ismount(path):
        raise InputError(
            f"{path} is a mount point, which cannot be kept: unmount it or move it out"
        )
    to.mkdir()
    for inner in path.iterdir():
        _keep(inner, to / inner.name)
    shutil.copystat(path, to)


def _copy(path: Path, to: Path) -> None:
    if not (path.is_symlink() or is_file(path)):
        raise InputError(f"{path} is no plain file and cannot be kept: move it out")
    shutil.copy2(path, to, follow_symlinks=False)
