"""Where builds keep results, and the digest of the code that they follow from."""

import os
import platform
import re
import stat
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib.metadata import requires, version
from importlib.util import find_spec
from pathlib import Path

from tbcad_verify.run.kept import Store, kept

__all__ = ["code_digest", "kept", "store", "told"]

VARIABLE = "TBCAD_CACHE"  # the folder, "" for none; by default tbcad in the user's cache
LIMIT = 2 << 30  # bytes that are kept: some ten builds at n = 18


def store(fresh: bool) -> Store:
    """The user's store; fresh: nothing of it is used. None is where others may write."""
    return Store(_folder(), code_digest(), fresh)


def told(kept_in: Store) -> str:
    """The line that says what was reused; empty where nothing was."""
    names = ", ".join(sorted(kept_in.reused))
    return f"reused: {names}; --fresh builds all" if names else ""


def _folder() -> Path | None:
    named = os.environ.get(VARIABLE)
    if named == "":
        return None
    above = Path(os.environ.get("XDG_CACHE_HOME") or Path(os.path.expanduser("~"), ".cache"))
    folder = Path(named) if named else above / "tbcad"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError:
        return None
    # Results are read by pickle: what another user could have put there may do anything.
    own = not hasattr(os, "getuid") or found.st_uid == os.getuid()
    return folder if own and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH) else None


@cache
def code_digest() -> str:
    """SHA-256 of all files of tbcad and its verification, libraries' versions and processor."""
    found = sha256()
    for line in (*_sources(), *_libraries(), *_processor()):
        found.update(line + b"\n")
    return found.hexdigest()


def _sources() -> Iterator[bytes]:
    for package in ("tbcad", "tbcad_verify"):
        spec = find_spec(package)
        root = Path(spec.origin or "").parent if spec else Path()
        for folder, inner, names in os.walk(root):
            # compiled loops are written beside the sources
            inner[:] = sorted(name for name in inner if name != "__pycache__")
            for name in sorted(name for name in names if not name.endswith(".pyc")):
                path = Path(folder, name)
                yield path.relative_to(root).as_posix().encode()
                yield sha256(path.read_bytes()).digest()


def _libraries() -> Iterator[bytes]:
    needed = (one for one in requires("tbcad") or () if "extra ==" not in one)
    for name in sorted(re.split(r"[^\w.-]", one)[0] for one in needed):
        yield f"{name} {version(name)}".encode()


def _processor() -> Iterator[bytes]:
    """Numerical libraries choose their code by it, and sums may end in another digit."""
    from numpy.lib import introspect  # of the loops that numpy chose, by function

    yield f"{platform.python_version()} {platform.platform()}".encode()
    yield repr(introspect.opt_func_info()).encode()
