"""HDF5 files as they are read: plain arrays of numbers, each in the file itself under one name.

A link could name any file of the computer, and a few bytes could claim terabytes: what tbcad never
writes is refused before anything is read of it.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from math import prod
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import h5py

from tbcad.cad.formats.checked_files import parse_json
from tbcad.errors import InputError

Found = TypeVar("Found")
Damaged: TypeAlias = Callable[[BaseException], InputError]

# Bytes an array keeps unpacked: mirrors side by side share chunks, two rows of which fit in.
CHUNK_CACHE = 32 << 20
MAX_CHUNK_BYTES = 256 << 20  # which are unpacked at once
MAX_RATIO = 1100  # of unpacked to stored bytes; deflate reaches 1032
FILTERS = frozenset((h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32))
KINDS = "uifS"  # of numbers, and of texts of one length
UNREADABLE = (KeyError, ValueError, TypeError, AttributeError, IndexError, OSError, RuntimeError)


@dataclass(frozen=True)
class StoredArray:
    """An array in an open file, read by slices."""

    _data: h5py.Dataset = field(repr=False)
    _damaged: Damaged = field(repr=False)

    @property
    def shape(self) -> tuple[int, ...]:
        """Its shape."""
        return tuple(self._data.shape)

    @property
    def dtype(self) -> Any:
        """Kind of its elements, a `numpy.dtype`."""
        return self._data.dtype

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, part: Any) -> Any:
        """Read a part; InputError where the file is damaged there, or closed."""
        if not self._data:
            raise InputError("the file is closed: read its arrays within the block that opened it")
        try:
            return self._data[part]
        except (OSError, RuntimeError) as error:
            raise self._damaged(error) from error


@dataclass(frozen=True)
class StoredGroup:
    """A group of an open file; each name leads to something else, in this very file."""

    _group: h5py.Group = field(repr=False)
    _damaged: Damaged = field(repr=False)
    _seen: set[Any] = field(default_factory=set, repr=False)

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Of the group, by name."""
        attributes: Mapping[str, Any] = self._group.attrs
        return attributes

    @property
    def facts(self) -> dict[str, Any]:
        """The table that its attribute of this name has as JSON."""
        facts = parse_json(self.attributes["facts"])
        if not isinstance(facts, dict):
            raise ValueError("its facts are no table")
        return facts

    def __contains__(self, name: str) -> bool:
        """Whether anything has the name, be it a link that leads nowhere."""
        return self._group.get(name, getlink=True) is not None

    def group(self, name: str) -> "StoredGroup":
        """A group in this one; ValueError if it is none of this file, or has another name too."""
        return StoredGroup(self._member(name, h5py.Group), self._damaged, self._seen)

    def array(self, name: str) -> StoredArray:
        """An array in this group; ValueError as of `group`, or if it is none that tbcad writes."""
        data = self._member(name, h5py.Dataset)
        if reason := _refused(data):
            raise ValueError(f"array {name} of {self._group.name} {reason}")
        return StoredArray(data, self._damaged)

    def _member(self, name: str, kind: type[Any]) -> Any:
        if not isinstance(self._group.get(name, getlink=True), h5py.HardLink):
            raise ValueError(f"{name} of {self._group.name} is missing or lies elsewhere")
        member: Any = self._group[name]
        if not isinstance(member, kind):
            raise ValueError(f"{name} of {self._group.name} is no {kind.__name__.lower()}")
        place = h5py.h5o.get_info(member.id).addr
        if place in self._seen:
            raise ValueError(f"{name} of {self._group.name} has another name too")
        self._seen.add(place)
        return member


@contextmanager
def open_hdf5(
    file: Path, schema: str, what: str, again: str, read: Callable[[StoredGroup], Found]
) -> Iterator[Found]:
    """Open a file as `opened_hdf5` does; arrays stay open for the block."""
    store, found = opened_hdf5(file, schema, what, again, read)
    with store:
        yield found


def opened_hdf5(
    file: Path, schema: str, what: str, again: str, read: Callable[[StoredGroup], Found]
) -> tuple[h5py.File, Found]:
    """Open a file that exists, and read what is asked for; it is open while an array is kept.

    Its attribute schema must name the schema. What it is ("light field"), and what to do about a
    file that cannot be used, are for errors: InputError if it is no such file, has another schema,
    or is damaged.
    """
    try:
        store = h5py.File(file, "r", rdcc_nbytes=CHUNK_CACHE)
    except OSError as error:
        raise InputError(f"{file} is no {what}: {_line(error)}: {again}") from error
    with ExitStack() as refused:
        refused.enter_context(store)
        try:
            if (named := store.attrs.get("schema")) != schema:
                raise ValueError(f"its schema is {str(named)[:80]!r}, allowed is {schema!r}")
            found = read(StoredGroup(store, partial(_damaged, file, what, again)))
        except UNREADABLE as error:
            raise _damaged(file, what, again, error) from error
        refused.pop_all()
    return store, found


def _damaged(file: Path, what: str, again: str, error: BaseException) -> InputError:
    return InputError(f"{file} is a damaged {what}: {_line(error)}: {again}")


def _refused(data: h5py.Dataset) -> str:
    """Why an array is none that tbcad writes, or nothing."""
    if data.external or data.is_virtual:
        return "lies elsewhere"
    if data.shape is None or data.dtype.kind not in KINDS:
        return f"holds {data.dtype}, not numbers"
    properties = data.id.get_create_plist()
    used = {properties.get_filter(k)[0] for k in range(properties.get_nfilters())}
    if unknown := used - FILTERS:
        return f"is packed by the unknown filter {min(unknown)}"
    chunk = prod(data.chunks or (0,)) * data.dtype.itemsize
    if chunk > MAX_CHUNK_BYTES or data.nbytes > MAX_RATIO * data.id.get_storage_size() + chunk:
        return f"claims {data.nbytes} bytes, which the file cannot hold"
    return ""


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
