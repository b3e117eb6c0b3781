"""Hidden folders beside an output folder, and who writes them.

A writer locks its folder, `.tbcad-<digest of the target>-<process>-<digest of the host>.new`. Where
its lock cannot be seen, on another host or without locks, a folder that changes is being written.
"""

import os
import platform
import re
import shutil
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import time

from tbcad.errors import InputError

try:
    import fcntl
except ImportError:  # no POSIX: tbcad can be imported, and writes without locks
    fcntl = None  # type: ignore[assignment]

# Earlier names have no host, or the start of the process before it.
_NAME = re.compile(r"\.tbcad-[0-9a-f]{8}-\d+(?:(?:-\d+)?-(?P<host>[0-9a-f]{8}))?\.new")
_DAY_S = 86_400.0  # a folder that has not changed for so long is not written


def new_folder(target: Path) -> Path:
    """Return the folder in which this process writes what is to replace the target."""
    return target.parent / f"{_prefix(target)}{os.getpid()}-{_host()}.new"


def clear(out: Path, target: Path) -> None:
    """Remove what killed writers left in the locked parent of a target, and repair a half exchange.

    InputError: another one is writing it.
    """
    hidden = [path for path in _hidden(target.parent) if path.name.startswith(_prefix(target))]
    if written := next(filter(_is_written, hidden), None):
        raise InputError(
            f"{out} is being written by another tbcad: wait for it to end, or remove {written} if "
            "it was killed"
        )
    moved_aside = [path for path in hidden if path.suffix == ".old"]
    if moved_aside and not target.exists():
        moved_aside[0].rename(target)
    inner = _hidden(target) if target.is_dir() else []
    others = [path for path in (*_hidden(target.parent), *inner) if _NAME.fullmatch(path.name)]
    live = {path for path in others if path not in hidden and _is_written(path)}
    if live.intersection(inner):
        raise InputError(f"{out} holds a folder that another tbcad writes: wait for it to end")
    for path in {*hidden, *others} - live:
        discard(path)


def discard(folder: Path) -> None:
    """Remove a folder as far as the user may."""
    for inner, _, _ in os.walk(folder):
        with suppress(OSError):
            Path(inner).chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a folder for the block, where the file system can."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # a file system without locks: see _is_written
            if fcntl:
                fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _prefix(target: Path) -> str:
    # A digest, since the folder's own name may be as long as names can be.
    return f".tbcad-{zlib.crc32(os.fsencode(target.name)):08x}-"


def _host() -> str:
    return f"{zlib.crc32(os.fsencode(platform.node())):08x}"


def _hidden(folder: Path) -> list[Path]:
    return [
        path
        for path in sorted(folder.glob(".tbcad-*"))
        if path.suffix in (".new", ".old") and path.is_dir() and not path.is_symlink()
    ]


def _is_written(folder: Path) -> bool:
    """Tell whether the writer of a hidden folder is alive."""
    told = _NAME.fullmatch(folder.name)
    seen = told is None or told["host"] in (None, _host())  # a lock that it has
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        if fcntl:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        seen = False
    finally:
        os.close(descriptor)
    return not (seen and fcntl) and _changed_lately(folder)


def _changed_lately(folder: Path) -> bool:
    times = [folder.stat().st_mtime]
    for inner, folders, files in os.walk(folder):
        for name in (*folders, *files):
            with suppress(OSError):
                times.append(Path(inner, name).lstat().st_mtime)
    return time() - max(times) < _DAY_S
