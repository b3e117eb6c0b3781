"""The output folder, replaced as a whole or not at all.

A new export is written into a hidden folder beside the old one, `.tbcad-<digest>-<pid>.new`, which
its writer holds locked; then the two are swapped in one step of the system. Where a system has no
such step the old one is first moved aside, as `.old`; a kill between the two moves is repaired
when the folder is next used. What killed writers left behind is removed then too. POSIX only.
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

from tbcad.errors import InputError
from tbcad.output.foreign_files import foreign_files, is_file, keep_files

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
_NO_EXCHANGE = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP)
_NAMED = 3


def check_replaceable(out: Path, force: bool) -> None:
    """Check, before any work, that a folder can be replaced.

    Args:
        out: the folder, which need not exist.
        force: whether files that tbcad did not write may be in it.

    Raises:
        InputError: it cannot; the text says why and what to do.
    """
    with _in_words(out):
        target = _target(out)
        if target.parent.is_dir():
            with _locked(target.parent):
                _clear(out, target)
        _checked_leftovers(out, target, force)


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
        with _in_words(out):
            target = _target(out)
            _make_parents(target.parent, undo)
            new = _open_new(out, target, force, undo)
        yield new
        with _in_words(out):
            _finish(out, new, force)


@contextmanager
def _in_words(out: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links, a null character
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{out} cannot be written: {reason}: choose another folder") from error


def _target(out: Path) -> Path:
    """Return the real place of an output folder, when it is one that may be replaced."""
    target = out.resolve()
    home, here = Path(os.path.expanduser("~")).resolve(), Path.cwd()
    if here.is_relative_to(target) or home.is_relative_to(target):
        whose = (
            "the folder you are in" if here == target else "your home or a folder above your work"
        )
        raise InputError(f"{out} is {whose} and would be replaced: name a folder inside it")
    if target.exists() and not target.is_dir():
        raise InputError(f"{out} is a file, not a folder: choose another name")
    if os.path.ismount(target):
        raise InputError(f"{out} is a mount point and cannot be replaced: name a folder inside it")
    _check_writable(out, target)
    return target


def _check_writable(out: Path, target: Path) -> None:
    for folder in [target, *target.parents]:
        if not folder.exists():
            continue
        if not folder.is_dir():
            raise InputError(f"{out} cannot be made: {folder} is a file: choose another folder")
        if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            raise InputError(
                f"{out} cannot be written: {folder} is read-only: choose another folder"
            )
        if folder != target:
            return


def _checked_leftovers(out: Path, target: Path, force: bool) -> list[Path]:
    """Return what in a folder must be kept, when it may be there."""
    found = foreign_files(target) if target.is_dir() else []
    if found and not force:
        names = ", ".join(path.name for path in found[:_NAMED])
        more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        raise InputError(
            f"{out} holds what tbcad did not write ({names}{more}): "
            "choose another folder, or keep them in the new one with --force"
        )
    return found


def _make_parents(folder: Path, undo: ExitStack) -> None:
    missing = [parent for parent in [folder, *folder.parents] if not parent.exists()]
    for parent in reversed(missing):
        parent.mkdir(exist_ok=True)
        undo.callback(_remove_empty, parent)  # which an export inside prevents


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def _open_new(out: Path, target: Path, force: bool, undo: ExitStack) -> Path:
    """Make the folder for the new export, locked until the end of undo, which removes it."""
    with _locked(target.parent):
        _clear(out, target)
        _checked_leftovers(out, target, force)
        new = target.parent / f"{_prefix(target)}{os.getpid()}.new"
        new.mkdir()
        undo.callback(_discard, new)  # the old export, once the two are swapped
        undo.enter_context(_locked(new))
    return new


def _prefix(target: Path) -> str:
    # A digest, since the folder's own name may be as long as names can be.
    return f".tbcad-{zlib.crc32(os.fsencode(target.name)):08x}-"


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # no locks here: process numbers must do, see _is_written
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _clear(out: Path, target: Path) -> None:
    """Repair and remove what killed writers left; refuse when another one is at work."""
    aside = [
        path
        for path in target.parent.glob(f"{_prefix(target)}*")
        if path.is_dir() and not path.is_symlink()
    ]
    if any(_is_written(path) for path in aside):
        raise InputError(f"{out} is being written by another tbcad: wait for it to end")
    moved = [path for path in aside if path.suffix == ".old"]
    if moved and not target.exists():
        moved[0].rename(target)
    for path in aside:
        _discard(path)


def _is_written(folder: Path) -> bool:
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return _runs(folder.stem.rpartition("-")[2])
    finally:
        os.close(descriptor)
    return False


def _runs(process: str) -> bool:
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, ValueError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _finish(out: Path, new: Path, force: bool) -> None:
    target = _target(out)  # again: the user may have been at work since
    keep_files(_checked_leftovers(out, target, force), new)
    if target.is_dir():
        shutil.copymode(target, new)
    _sync(new)
    with _locked(target.parent):
        _swap(new, target)
    _sync_entry(target.parent)


def _sync(folder: Path) -> None:
    for inner, _, files in os.walk(folder):
        for name in files:
            path = Path(inner, name)
            if is_file(path):
                _sync_entry(path)
        _sync_entry(Path(inner))


def _sync_entry(path: Path) -> None:
    with suppress(PermissionError):  # a kept file which the user may not read
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _swap(new: Path, target: Path) -> None:
    if not target.exists():
        new.rename(target)
    elif not _exchange(new, target):
        _move_both(new, target)


def _exchange(one: Path, other: Path) -> bool:
    """Swap two folders in one step; False where the system or file system has no such step."""
    swap = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if swap is None:
        return False
    names = [os.fsencode(one), os.fsencode(other)]
    if swap(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE) == 0:
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
