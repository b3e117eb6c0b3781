"""The output folder, replaced atomically, and only by content of the same kind.

New content is written into a hidden folder beside the old one, which its writer locks; then both
are exchanged by one system call. Where a system has no such call, the old one is first moved aside,
as `.old`; a kill between the two moves is repaired when the folder is next used. Hidden folders,
`.tbcad-<digest of the target>-<process>-<digest of the host>.new`, of killed writers are removed
then too; where a lock cannot be seen, on another host or without locks, a folder that changes is
being written. POSIX only. Which content replaces which: docs/conventions.md.
"""

import ctypes
import errno
import os
import platform
import re
import shutil
import zlib
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from time import time

from tbcad.common.atomic_files import write_errors_as_input_errors
from tbcad.errors import InputError
from tbcad.output.manifest import is_file, refuse_other_content
from tbcad.output.single_files import (
    Source,
    foreign_files,
    is_always_kept,
    keep_files,
    refuse_inputs,
)
from tbcad.records.document import Kind

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


_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
_NO_EXCHANGE = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP)
_MAX_NAMES = 3  # of foreign files in an error


def check_replaceable(out: Path, kind: Kind, force: bool, inputs: Iterable[Source] = ()) -> None:
    """Check, before any work, that a folder, which need not exist, can be replaced.

    With force also content that costs hours, and among files that tbcad did not write. Inputs are
    files and folders that are read for it.

    InputError: it cannot; the text says why and what to do.
    """
    with write_errors_as_input_errors(out):
        target = _target(out)
        refuse_inputs(out, inputs)
        if target.parent.is_dir():
            with locked(target.parent):
                clear(out, target)
        _files_to_keep(out, target, kind, force)


@contextmanager
def replacing(out: Path, kind: Kind, force: bool, inputs: Iterable[Source] = ()) -> Iterator[Path]:
    """Give a folder to write content into, which replaces out when the block ends well.

    Missing parents are made. With force content that costs hours is replaced, and files that tbcad
    did not write are kept; without, both are refused. Inputs are read for it.

    InputError: out cannot be replaced; it is then as before.
    """
    with ExitStack() as undo:
        with write_errors_as_input_errors(out):
            target = _target(out)
            refuse_inputs(out, inputs)
            _make_parents(target.parent, undo)
            new = _open_new(out, target, kind, force, undo)
        try:
            yield new
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.ENOMEM):  # of processes, not of the disk
                raise
            reason = error.strerror or str(error)
            raise InputError(
                f"{out} cannot be written: {reason}: make room on the disk, or choose another "
                "folder; nothing was changed"
            ) from error
        with write_errors_as_input_errors(out):
            _finish(out, new, kind, force)


def _target(out: Path) -> Path:
    """Return the absolute path of an output folder, links resolved, if it may be replaced."""
    target = out.resolve()
    home, current = Path(os.path.expanduser("~")).resolve(), Path.cwd()
    if current == target:
        raise InputError(
            f"{out} is the folder you are in and would be replaced: name a folder inside it"
        )
    if current.is_relative_to(target) or home.is_relative_to(target):
        raise InputError(
            f"{out} is your home or a folder above your work and would be replaced: "
            "name a folder inside it"
        )
    if target.exists() and not target.is_dir():
        raise InputError(f"{out} is a file, not a folder: choose another name")
    if os.path.ismount(target):
        raise InputError(f"{out} is a mount point and cannot be replaced: name a folder inside it")
    _check_writable(out, target)
    return target


def _check_writable(out: Path, target: Path) -> None:
    nearest = next(folder for folder in target.parents if folder.exists())
    if not nearest.is_dir():
        raise InputError(f"{out} cannot be made: {nearest} is a file: choose another folder")
    for folder in (target, nearest):
        if folder.exists() and not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            raise InputError(
                f"{out} cannot be written: {folder} is read-only: choose another folder"
            )


def _files_to_keep(out: Path, target: Path, kind: Kind, force: bool) -> list[Path]:
    """Return the user's files in a folder; without force, all but a few names are refused."""
    refuse_other_content(out, target, kind, force)
    foreign = foreign_files(target) if target.is_dir() else []
    refused = [] if force else [path for path in foreign if not is_always_kept(path)]
    if refused:
        names = ", ".join(path.name for path in refused[:_MAX_NAMES])
        more = f" and {len(refused) - _MAX_NAMES} more" if len(refused) > _MAX_NAMES else ""
        raise InputError(
            f"{out} holds what tbcad did not write ({names}{more}): "
            "choose another folder, or keep them in the new one with --force"
        )
    return foreign


def _make_parents(folder: Path, undo: ExitStack) -> None:
    missing = [parent for parent in [folder, *folder.parents] if not parent.exists()]
    for parent in reversed(missing):
        parent.mkdir(exist_ok=True)
        undo.callback(_remove_empty, parent)  # which a build inside prevents


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def _open_new(out: Path, target: Path, kind: Kind, force: bool, undo: ExitStack) -> Path:
    """Make the folder for the new build; undo unlocks and removes it."""
    with locked(target.parent):
        clear(out, target)
        _files_to_keep(out, target, kind, force)
        new = new_folder(target)
        new.mkdir()
        undo.callback(discard, new)  # the old export, once both are exchanged
        undo.enter_context(locked(new))
    return new


def _finish(out: Path, new: Path, kind: Kind, force: bool) -> None:
    target = _target(out)  # again: the user may have been at work since
    keep_files(_files_to_keep(out, target, kind, force), new)
    if target.is_dir():
        shutil.copymode(target, new)
    _sync(new)
    with locked(target.parent):
        if not target.exists():
            new.rename(target)
        elif not _exchange(new, target):
            _move_both(new, target)
    _sync_entry(target.parent)


def _sync(folder: Path) -> None:
    for inner, _, names in os.walk(folder):
        for path in (*(Path(inner, name) for name in names), Path(inner)):
            if path == Path(inner) or is_file(path):
                _sync_entry(path)


def _sync_entry(path: Path) -> None:
    with suppress(PermissionError):  # a kept file which the user may not read
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two folders by one system call; False where the system has no such call."""
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        return False
    names = [os.fsencode(one), os.fsencode(other)]
    if rename(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE) == 0:
        return True
    if (number := ctypes.get_errno()) in _NO_EXCHANGE:
        return False
    raise OSError(number, os.strerror(number), str(other))


def _move_both(new: Path, target: Path) -> None:
    old = new.with_suffix(".old")
    target.rename(old)
    try:
        new.rename(target)
    except BaseException:  # an interrupt too
        if not target.exists():
            old.rename(target)
        raise
    discard(old)
