"""Reading an untrusted folder: plain names, regular files, limited sizes."""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.errors import BadExport

MAX_BYTES = 4 * 10**9
HEAD = 84  # bytes that tell what a file is
MAX_TEXT_BYTES = 256 * 10**6
AGAIN = "write it again with `tbcad build`"


@dataclass(frozen=True)
class FileBytes:
    """One file as it was when it was read: what is hashed is what is parsed."""

    name: str  # path inside the build, with forward slashes
    data: NDArray[np.uint8]  # the bytes, shape (size,), uint8
    sha256: str  # hex digest of exactly these bytes

    @property
    def digest(self) -> tuple[int, str]:
        """Size in bytes, and sha256."""
        return self.data.size, self.sha256

    def text(self) -> str:
        """The bytes as UTF-8 text. BadExport: the file is not UTF-8."""
        try:
            return self.data.tobytes().decode("utf-8")
        except UnicodeDecodeError as error:
            raise BadExport(
                f"{self.name}: not UTF-8 text ({error.reason} at byte {error.start}); {AGAIN}"
            ) from error


def open_folder(folder: Path) -> Path:
    """The folder itself, resolved. BadExport: it is missing or is no folder."""
    if not folder.exists():
        raise BadExport(f"{folder}: no such folder; give the folder that `tbcad build` wrote")
    if not folder.is_dir():
        raise BadExport(f"{folder}: not a folder; give the folder that `tbcad build` wrote")
    return folder.resolve()


def locate(folder: Path, name: str) -> Path:
    """The path of a regular file inside the build, and never of anything outside it.

    BadExport: the name leaves the folder, or the file is missing, no regular file or too big.
    """
    refuse_unsafe(name)
    path = folder / name
    try:
        real = path.resolve(strict=True)
        info = real.stat()
    except (OSError, RuntimeError) as error:
        raise BadExport(f"{name}: missing from {folder}; {AGAIN}") from error
    if not real.is_relative_to(folder):
        raise BadExport(f"{name}: a link that leads out of the build; only files inside count")
    if not stat.S_ISREG(info.st_mode):
        raise BadExport(f"{name}: not a regular file; {AGAIN}")
    if info.st_size > MAX_BYTES:
        raise BadExport(f"{name}: {info.st_size} bytes; at most {MAX_BYTES} are read")
    return real


def refuse_other_kinds(folder: Path, names: Iterable[str]) -> None:
    """Refuse folders, pipes and devices where files are listed; what is missing is found later.

    BadExport: it names the first.
    """
    for name in names:
        with contextlib.suppress(OSError, ValueError):
            mode = (folder / name).stat().st_mode
            if not stat.S_ISREG(mode):
                kind = "a folder" if stat.S_ISDIR(mode) else "a pipe or device"
                raise BadExport(
                    f"{name}: not a regular file but {kind}, yet in the manifest; {AGAIN}"
                )


def read(
    folder: Path,
    name: str,
    limit: int = MAX_BYTES,
    expect: Callable[[str, int, bytes], None] = lambda _name, _size, _head: None,
) -> FileBytes:
    """Read a whole file once, and hash what was read.

    `limit`: largest size allowed, bytes.
    `expect`: called with name, size and the first bytes before the rest is read; may refuse.

    BadExport as `locate`, over the limit, or the file changed while it was read.
    """
    path = locate(folder, name)
    try:
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            if size > limit:
                raise BadExport(f"{name}: {size} bytes; at most {limit} are read")
            expect(name, size, stream.read(HEAD))
            stream.seek(0)
            data = np.fromfile(stream, dtype=np.uint8, count=size)
            rest = stream.read(1)
    except OSError as error:
        raise BadExport(f"{name}: cannot be read ({error.strerror}); {AGAIN}") from error
    if data.size != size or rest:
        raise BadExport(f"{name}: changed while it was read; let the build finish, then verify")
    return FileBytes(name, data, hashlib.sha256(data.data).hexdigest())


def digest(folder: Path, name: str) -> tuple[int, str]:
    """Size in bytes and sha256 of a file that is not parsed; BadExport as `locate`."""
    path = locate(folder, name)
    with path.open("rb") as stream:
        return os.fstat(stream.fileno()).st_size, hashlib.file_digest(stream, "sha256").hexdigest()


def stamps(folder: Path, names: Iterable[str]) -> dict[str, tuple[int, ...]]:
    """Signs that a file was replaced or written to: device, inode, size and times, by name.

    Files that are not there are left out.
    """
    entries: dict[str, tuple[int, ...]] = {}
    for name in names:
        with contextlib.suppress(OSError):
            info = (folder / name).stat()
            entries[name] = (info.st_dev, info.st_ino, info.st_size, info.st_mtime_ns)
    return entries


def listing(folder: Path) -> frozenset[str]:
    """Every file below the folder, by relative name; linked folders are not entered."""
    entries = (
        Path(root, name).relative_to(folder).as_posix()
        for root, _, names in os.walk(folder)
        for name in names
    )
    return frozenset(entries)


def refuse_unsafe(name: str) -> None:
    """Refuse names that lead, or might lead, out of the build.

    BadExport: absolute, with `..`, a drive, or another system's separators.
    """
    parts = PurePosixPath(name).parts
    bad = not parts or name.startswith("/") or ".." in parts or "\\" in name or "\0" in name
    if bad or ":" in parts[0]:
        raise BadExport(f"{name!r}: not a plain file name inside the build; {AGAIN}")
