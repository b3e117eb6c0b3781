"""The output folder, replaced as a whole or not at all.

A new export is written into a hidden folder beside the old one, `.tbcad-<digest>-<pid>.new`, which
its writer locks; then both are exchanged by one system call. Where a system has no such call, the
old one is first moved aside, as `.old`; a kill between the two moves is repaired when the folder is
next used. Hidden folders of killed writers are removed then too. POSIX only.
"""

import ctypes
import errno
import fcntl
import os
import shutil
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from tbcad.atomic_files import write_errors_as_input_errors
from tbcad.errors import InputError
from tbcad.output.foreign_files import foreign_files, is_always_kept, keep_files
from tbcad.output.manifest import is_file

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
_NO_EXCHANGE = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP)
_MAX_NAMES = 3  # of foreign files in an error


def check_replaceable(out: Path, force: bool) -> None:
    """Check, before any work, that a folder can be replaced.

    Args:
        out: the folder, which need not exist.
        force: whether files that tbcad did not write may be in it.

    Raises:
        InputError: it cannot; the text says why and what to do.
    """
    with write_errors_as_input_errors(out):
        target = _target(out)
        if target.parent.is_dir():
            with _locked(target.parent):
                _clear(out, target)
        _files_to_keep(out, target, force)


@contextmanager
def replacing(out: Path, force: bool) -> Iterator[Path]:
    """Give a folder to write an export into, which replaces out when the block ends well.

    Args:
        out: the folder to be replaced, which need not exist; missing parents are made.
        force: keep the files in it that tbcad did not write; without, they are refused.

    Raises:
        InputError: out cannot be replaced; it is then as before.
    """
    with ExitStack() as undo:
        with write_errors_as_input_errors(out):
            target = _target(out)
            _make_parents(target.parent, undo)
            new = _open_new(out, target, force, undo)
        try:
            yield new
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(
                f"{out} cannot be written: {reason}: make room on the disk, or choose another "
                "folder; nothing was changed"
            ) from error
        with write_errors_as_input_errors(out):
            _finish(out, new, force)


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


def _files_to_keep(out: Path, target: Path, force: bool) -> list[Path]:
    """Return the user's files in a folder; without force, all but a few names are refused."""
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
        undo.callback(_remove_empty, parent)  # which an export inside prevents


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def _open_new(out: Path, target: Path, force: bool, undo: ExitStack) -> Path:
    """Make the folder for the new export; undo unlocks and removes it."""
    with _locked(target.parent):
        _clear(out, target)
        _files_to_keep(out, target, force)
        new = target.parent / f"{_prefix(target)}{os.getpid()}.new"
        new.mkdir()
        undo.callback(_discard, new)  # the old export, once both are exchanged
        undo.enter_context(_locked(new))
    return new


def _prefix(target: Path) -> str:
    # A digest, since the folder's own name may be as long as names can be.
    return f".tbcad-{zlib.crc32(os.fsencode(target.name)):08x}-"


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    _LOCKS.add(descriptor)
    try:
        with suppress(OSError):  # a file system without locks: see _is_written
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
os.register_at_fork(after_in_child=_leave_locks)


def _clear(out: Path, target: Path) -> None:
    """Repair and remove what killed writers left; refuse when another one is at work."""
    hidden = [
        path
        for path in target.parent.glob(f"{_prefix(target)}*")
        if path.is_dir() and not path.is_symlink()
    ]
    if any(_is_written(path) for path in hidden):
        raise InputError(f"{out} is being written by another tbcad: wait for it to end")
    moved_aside = [path for path in hidden if path.suffix == ".old"]
    if moved_aside and not target.exists():
        moved_aside[0].rename(target)
    for path in hidden:
        _discard(path)


def _is_written(folder: Path) -> bool:
    """Tell whether the writer of a hidden folder is alive."""
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return _runs(folder.stem.rpartition("-")[2])
    finally:
        os.close(descriptor)
    return False


def _runs(process: str) -> bool:
    """Tell whether a process of this number runs."""
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, ValueError, OverflowError):
        return False
    except PermissionError:  # it is another user's
        return True
    return True


def _finish(out: Path, new: Path, force: bool) -> None:
    target = _target(out)  # again: the user may have been at work since
    keep_files(_files_to_keep(out, target, force), new)
    if target.is_dir():
        shutil.copymode(target, new)
    _sync(new)
    with _locked(target.parent):
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
    _discard(old)


def _discard(folder: Path) -> None:
    for inner, _, _ in os.walk(folder):
        with suppress(OSError):
            Path(inner).chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)
