"""Results that are kept under a digest of all that they follow from.

A function that is `kept` is one of its arguments alone: its key is the SHA-256 of the code's
digest, its own name and the values of all its arguments. Nothing asks for names of keys of a
design, for time stamps or for the files that an earlier build left. `tbcad` keeps by this too, for
`tbcad build` alone: without a store (`keeping`) every function is simply called, and so
`tbcad-verify` and `tbcad verify` always verify afresh.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache, cached_property, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

Work = TypeVar("Work", bound=Callable[..., Any])
DIGEST = 32  # bytes of a SHA-256
PREFIX, PARTIAL = "kept-", ".partial"  # of names in a store; the second while one is written


@dataclass(frozen=True)
class Store:
    """Where results are kept: a folder of the user, which nobody else may write."""

    folder: Path | None  # None: nothing is kept
    code: str  # digest of all code and data that may change a result
    fresh: bool = False  # everything is worked out, and kept in place of what there is
    reused: set[str] = field(default_factory=set)  # subjects of what was not worked out

    def file(self, key: str) -> Path:
        """The file of a result; there must be a folder."""
        assert self.folder
        return self.folder / f"{PREFIX}{key}"

    def get(self, key: str) -> Any:
        """A result, or None: there is none, or it is damaged, and then dropped."""
        if self.folder is None or self.fresh:
            return None
        file = self.file(key)
        try:
            if not _is_own_file(file):
                return None
            data = file.read_bytes()
            if _digest(key, data[DIGEST:]) != data[:DIGEST]:
                file.unlink()
                return None
            with contextlib.suppress(OSError):
                os.utime(file)  # for `prune` alone
            return pickle.loads(data[DIGEST:])
        except OSError:
            return None

    def put(self, key: str, data: bytes) -> None:
        """Keep a pickled result, atomically; a store that cannot be written keeps nothing."""
        if self.folder is None:
            return
        with contextlib.suppress(OSError):
            number, name = tempfile.mkstemp(PARTIAL, PREFIX, self.folder)
            try:
                with os.fdopen(number, "wb") as file:
                    file.write(_digest(key, data))
                    file.write(data)
                os.replace(name, self.file(key))
            except BaseException:  # an interrupt, a full disk
                with contextlib.suppress(OSError):
                    os.unlink(name)
                raise

    def prune(self, limit: int) -> None:
        """Remove what was not used for longest, until the rest has so many bytes at most."""
        total = 0
        for found, file in sorted(self._entries(), key=lambda pair: -pair[0].st_mtime):
            total += found.st_size
            if total > limit:
                with contextlib.suppress(OSError):  # no file, or of another user
                    file.unlink()

    def forget(self, since: float) -> None:
        """Remove what was kept or used since a time (s, of the clock)."""
        for found, file in self._entries():
            if found.st_mtime >= since:
                with contextlib.suppress(OSError):
                    file.unlink()

    def _entries(self) -> Iterator[tuple[os.stat_result, Path]]:
        """What lies in the folder, whatever it is, but for what another build just removed."""
        for file in self.folder.glob(f"{PREFIX}*") if self.folder else ():
            with contextlib.suppress(OSError):
                yield file.lstat(), file


STORE: ContextVar[Store | None] = ContextVar("STORE", default=None)


@contextlib.contextmanager
def keeping(store: Store | None) -> Iterator[None]:
    """Keep and use results in a store while the block runs, here and in processes begun for it."""
    token = STORE.set(store)
    try:
        yield
    finally:
        STORE.reset(token)


def kept(
    subject: str, *, heard: bool = False, sure: Callable[[Any], bool] = lambda _: True
) -> Callable[[Work], Work]:
    """Keep the results of a function of its arguments alone.

    `subject`: what a user is told was reused. `heard`: the last argument is called with what is
    found on the way; that is kept, and heard again. `sure`: tells whether a result, or what was
    heard, follows from the arguments alone: one that a time limit or a lack of memory made is not
    kept. A path among the arguments is either a file, which counts by its content, or a folder that
    the function writes its files into: into an empty one, of which it can read nothing.
    """

    def decorated(work: Work) -> Work:
        @wraps(work)
        def call(*arguments: Any) -> Any:
            store = STORE.get()
            if store is None:
                return work(*arguments)
            sink = arguments[-1] if heard and callable(arguments[-1]) else None
            given = arguments[:-1] if sink else arguments
            return _reused(Kept(subject, work, heard, sure), store, given, sink or (lambda _: None))

        return cast("Work", call)

    return decorated


@dataclass(frozen=True)
class Kept:
    """What is kept: see `kept`."""

    subject: str
    work: Callable[..., Any]
    heard: bool
    sure: Callable[[Any], bool]


def is_kept(work: Callable[..., Any], *arguments: Any) -> bool:
    """Whether a call of a kept function, without what hears it, would only read its result."""
    store = STORE.get()
    if store is None or store.folder is None or store.fresh:
        return False
    return store.file(_key(store, cast("Any", work).__wrapped__, arguments)).is_file()


def _key(store: Store, work: Callable[..., Any], arguments: tuple[Any, ...]) -> str:
    values = [None if _is_folder(given) else given for given in arguments]
    return digest((store.code, work.__module__, work.__qualname__, values))


def _reused(
    one: Kept, store: Store, arguments: tuple[Any, ...], sink: Callable[[Any], object]
) -> Any:
    folders = [given for given in arguments if _is_folder(given)]
    key = _key(store, one.work, arguments)
    found = store.get(key)
    if found is None:
        data = pickle.dumps(_worked_out(one, arguments, sink))
        found = pickle.loads(data)  # as it will be read: solids lose the sign of zeros on the way
        if all(map(one.sure, (found[0], *found[1]))):
            store.put(key, data)
    else:
        store.reused.add(one.subject)
        for value in found[1]:
            sink(value)
    result, _, files = found
    for folder in folders:
        for name, content in files.items():
            (folder / name).write_bytes(content)
    return result


def _worked_out(
    one: Kept, arguments: tuple[Any, ...], sink: Callable[[Any], object]
) -> tuple[Any, list[Any], dict[str, bytes]]:
    """Result, what was heard on the way, and the content of all files by name."""
    heard: list[Any] = []

    def hear(value: Any) -> None:
        heard.append(value)
        sink(value)

    with tempfile.TemporaryDirectory(prefix="tbcad-") as name:
        own = [Path(name) if _is_folder(given) else given for given in arguments]
        result = one.work(*own, *([hear] if one.heard else []))
        files = {file.name: file.read_bytes() for file in sorted(Path(name).iterdir())}
        return result, heard, files


@dataclass(frozen=True)
class Shared:
    """A value that many calls get: it is digested once."""

    value: Any

    @cached_property
    def digest(self) -> str:
        """Of the value."""
        return digest(self.value)


def _is_folder(argument: object) -> bool:
    return isinstance(argument, Path) and argument.is_dir()


def digest(value: object) -> str:
    """SHA-256 of a value: of equal values equal, whichever of their objects are the same."""
    written = _Hashed()
    pickler = _Canonical(written, protocol=5)
    pickler.fast = True  # no references to what came before: only values count
    pickler.dump(value)
    return written.found.hexdigest()


class _Hashed:
    """A file of which only the digest is kept."""

    def __init__(self) -> None:
        self.found = hashlib.sha256()

    def write(self, data: ReadableBuffer) -> None:
        self.found.update(data)


class _Canonical(pickle.Pickler):
    """Values alone: sets in order, files by content, nothing that objects have worked out since."""

    def persistent_id(self, value: Any) -> Any:
        """Stands for a value that is not written as it is; None for all others."""
        kind = type(value)
        if kind in (set, frozenset):
            return kind.__name__, sorted(map(digest, value))
        if kind is Shared or isinstance(value, Path):
            known = (
                value.digest if kind is Shared else hashlib.sha256(value.read_bytes()).hexdigest()
            )
            return kind.__name__, known
        if kind.__module__ == "trimesh.base":
            from numpy import array  # here: processes that need none begin without

            return kind.__name__, digest([array(value.vertices), array(value.faces)])
        if (kind.__module__, kind.__name__) == ("manifold3d", "Manifold"):
            mesh = value.to_mesh64()
            parts = mesh.vert_properties, mesh.tri_verts, value.get_tolerance()
            return kind.__name__, digest(parts)
        if names := _worked_out_later(cast("Any", kind)):
            rest = {name: one for name, one in vars(value).items() if name not in names}
            return kind.__module__, kind.__qualname__, digest(rest)
        return None


@cache
def _worked_out_later(kind: type) -> frozenset[str]:
    """Names of the cached properties of a class without a state of its own making."""
    if "__getstate__" in vars(kind) or "__reduce__" in vars(kind):
        return frozenset()
    each = (vars(one).items() for one in kind.__mro__)
    return frozenset(n for items in each for n, one in items if isinstance(one, cached_property))


def _is_own_file(file: Path) -> bool:
    """Whether it is a file, no link or pipe, and no other user's: entries are read by pickle."""
    found = file.lstat()
    return is_own(found) and stat.S_ISREG(found.st_mode)


def is_own(found: os.stat_result) -> bool:
    """Whether a file or folder is this user's, where users own files."""
    return not hasattr(os, "getuid") or found.st_uid == os.getuid()


def _digest(key: str, data: bytes) -> bytes:
    return hashlib.sha256(key.encode() + data).digest()
