"""Where builds keep results, and the digest of the code that they follow from."""

import os
import platform
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import Distribution, PackageNotFoundError, distributions
from importlib.util import find_spec
from pathlib import Path
from time import time

from tbcad_verify.run.kept import Store, is_own, keeping, kept

from tbcad.errors import InputError
from tbcad.version import LOADED

__all__ = ["check_is_apart", "code_digest", "kept", "reusing", "store", "told"]

VARIABLE = "TBCAD_CACHE"  # the folder, "" for none; by default tbcad in the user's cache
LIMIT = 2 << 30  # bytes that are kept: some ten builds at n = 18
# Beginnings of variables that choose threads and kernels of numerical libraries.
CHOOSING = ("BLIS_", "GOTO_", "MKL_", "NPY_", "NUMBA_", "OMP_", "OPENBLAS_")
CLOCK_S = 2.0  # by which clocks of files are coarser than that of the system


@contextmanager
def reusing(fresh: bool, answer: Callable[[str], object]) -> Iterator[None]:
    """Keep what is worked out in the block, use what is kept already, and say what was used.

    Nothing is kept where code has changed since this process began, or changes within the block:
    which of it is old and which new cannot be told.
    """
    kept_in, began = store(fresh), time()
    try:
        with keeping(kept_in):
            yield
    finally:
        if _digest() == kept_in.code:
            kept_in.prune(LIMIT)
        else:
            kept_in.forget(began - CLOCK_S)
    if line := told(kept_in):
        answer(line)


def store(fresh: bool) -> Store:
    """The user's store; fresh: nothing of it is used. None is where others may write."""
    own = code_digest()
    changed = own != _digest() or _changed_last() > LOADED
    return Store(None if changed else _folder(), own, fresh)


def told(kept_in: Store) -> str:
    """The line that says what was reused; empty where nothing was."""
    names = ", ".join(sorted(kept_in.reused))
    return f"reused: {names}; --fresh builds all" if names else ""


def check_is_apart(out: Path) -> None:
    """InputError: the store is in the folder that a build is to replace."""
    place = _place()
    if place and place.resolve().is_relative_to(out.resolve()):
        raise InputError(
            f"{VARIABLE} is {os.environ.get(VARIABLE) or place}, within the build's folder {out}, "
            "which is replaced: name a folder outside, or none"
        )


def _place() -> Path | None:
    named = os.environ.get(VARIABLE)
    if named == "":
        return None
    above = Path(os.environ.get("XDG_CACHE_HOME") or Path(os.path.expanduser("~"), ".cache"))
    return (Path(named) if named else above / "tbcad").absolute()


def _folder() -> Path | None:
    """The user's folder, which is made; None: there is none, or others may write it."""
    if (place := _place()) is None:
        return None
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = place.stat()
    except OSError:
        return None
    # Results are read by pickle: what another user could have put there may do anything.
    closed = not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return place if is_own(found) and closed else None


@cache
def code_digest() -> str:
    """SHA-256 of all files of tbcad and its verification, libraries' versions and processor.

    As first asked for in this process.
    """
    return _digest()


def _digest() -> str:
    found = sha256()
    for line in (*_sources(), *_libraries(), *_processor()):
        found.update(line + b"\n")
    return found.hexdigest()


def _sources() -> Iterator[bytes]:
    for root, path in _files():
        yield path.relative_to(root).as_posix().encode()
        yield sha256(path.read_bytes()).digest()


def _files() -> Iterator[tuple[Path, Path]]:
    """All files of both packages, each with its package's folder."""
    for package in ("tbcad", "tbcad_verify"):
        spec = find_spec(package)
        root = Path(spec.origin or "").parent if spec else Path()
        for folder, inner, names in os.walk(root):
            # compiled loops are written beside the sources
            inner[:] = sorted(name for name in inner if name != "__pycache__")
            paths = (Path(folder, name) for name in sorted(names) if not name.endswith(".pyc"))
            yield from ((root, path) for path in paths)


def _changed_last() -> float:
    """When a file of both packages was last written or put in its place, s of the clock."""
    stats = (path.stat() for _, path in _files())
    return max(max(found.st_mtime, found.st_ctime) for found in stats)


def _libraries() -> Iterator[bytes]:
    """Names and versions of all libraries that tbcad needs, and that these need."""
    try:
        found = _with_needed("tbcad", {})
    except PackageNotFoundError:  # tbcad is not installed, but found: all that is
        found = {one.name: one for one in distributions()}
    yield from sorted(f"{name} {one.version}".encode() for name, one in found.items())


def _with_needed(name: str, found: dict[str, Distribution]) -> dict[str, Distribution]:
    """Installed libraries by name: one, and all that it needs but for its extras."""
    found[name] = one = Distribution.from_name(name)
    for needed in one.requires or ():
        other = re.split(r"[^\w.-]", needed)[0].lower()
        if "extra ==" not in needed and other not in found:
            with suppress(PackageNotFoundError):  # of another Python, or another system
                _with_needed(other, found)
    return found


def _processor() -> Iterator[bytes]:
    """Numerical libraries choose their code by it, and sums may end in another digit.

    So they do by the number of threads that share a sum: by cores, or as variables say.
    """
    from numpy.lib import introspect  # of the loops that numpy chose, by function

    on_some = hasattr(os, "sched_getaffinity")
    yield f"{len(os.sched_getaffinity(0)) if on_some else os.cpu_count()} cores".encode()
    for name, value in sorted(os.environ.items()):
        if name.startswith(CHOOSING) and name != "NUMBA_CACHE_DIR":
            yield f"{name}={value}".encode()
    yield f"{platform.python_version()} {platform.platform()}".encode()
    yield repr(introspect.opt_func_info()).encode()
