"""Hidden folders beside an output folder, and who writes them.

A writer locks its folder. Where a file system has no locks, the folder's name tells its writer:
`.tbcad-<digest of the target>-<process>-<start of the process>-<digest of the host>.new`.
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

_NAME = re.compile(
    r"\.tbcad-[0-9a-f]{8}-(?P<process>\d+)(-(?P<start>\d+)-(?P<host>[0-9a-f]{8}))?\.new"
)
_DAY_S = 86_400.0  # a folder of another host that has not changed for so long is not written


def new_folder(target: Path) -> Path:
    """Return the folder in which this process writes what is to replace the target."""
    process = os.getpid()
    return target.parent / f"{_prefix(target)}{process}-{_start(process)}-{_host()}.new"


def clear(out: Path, target: Path) -> None:
    """Remove what killed writers left in the locked parent of a target, and repair a half exchange.

    InputError: another one is writing it.
    """
    hidden = [path for path in _hidden(target.parent) if path.name.startswith(_prefix(target))]
    if any(_is_written(path) for path in hidden):
        raise InputError(f"{out} is being written by another tbcad: wait for it to end")
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
    _LOCKS.add(descriptor)
    try:
        with suppress(OSError):  # a file system without locks: see _is_written
            if fcntl:
                fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        _LOCKS.discard(descriptor)
        os.close(descriptor)


def _leave_locks() -> None:
    """In a copy of this process: a lock must end with the process that took it."""
    for descriptor in _LOCKS:
        os.close(descriptor)
    _LOCKS.clear()


_LOCKS: set[int] = set()  # descriptors of locked folders
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_locks)


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
    process, start, host = told.group("process", "start", "host") if told else ("", None, None)
    locked_by_another = _is_locked(folder)
    if locked_by_another:
        return True
    if host not in (None, _host()):  # whose locks may not be seen here
        return _changed_lately(folder)
    if locked_by_another is None:
        return _runs(process, start)
    return False


def _is_locked(folder: Path) -> bool | None:
    """Tell whether another process holds the lock of a folder; None: there are no locks."""
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        if fcntl:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return None
    finally:
        os.close(descriptor)
    return False if fcntl else None


def _runs(process: str, start: str | None) -> bool:
    """Tell whether a process of this number runs, and began when it is said."""
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, ValueError, OverflowError):
        return False
    except PermissionError:  # it is another user's
        pass
    return start in (None, "0", _start(int(process)))


def _start(process: int) -> str:
    """Return when a process began, in ticks since the system did; "0" where nobody tells."""
    try:
        text = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return "0"
    return text.rpartition(")")[2].split()[19]  # proc(5): field 22, after a name that has blanks


def _changed_lately(folder: Path) -> bool:
    times = [folder.stat().st_mtime]
    for inner, folders, files in os.walk(folder):
        for name in (*folders, *files):
            with suppress(OSError):
                times.append(Path(inner, name).lstat().st_mtime)
    return time() - max(times) < _DAY_S
