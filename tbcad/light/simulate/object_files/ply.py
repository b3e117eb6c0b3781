"""PLY files (G. Turk, The PLY Polygon File Format, 1994), text and binary, with their colours."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    ObjectFile,
    ObjectPart,
    shown_shares,
    texture_beside,
    triangles,
    without_facets,
)
from tbcad.types import Bytes, Floats, Ints

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
MOST_ENTRIES = 1 << 20  # of a list
Values: TypeAlias = NDArray[Any]
COLOURS = (("red", "green", "blue"), ("r", "g", "b"),
           ("diffuse_red", "diffuse_green", "diffuse_blue"))  # fmt: skip
COORDINATES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))
CORNERS = ("vertex_indices", "vertex_index")
KNOWN = {*"xyz", "nx", "ny", "nz", "alpha", "a", "diffuse_alpha", "texcoord", "texnumber", "flags",
         "quality", "confidence", *CORNERS, *sum(COLOURS, ()), *sum(COORDINATES, ())}  # fmt: skip


class _Property(NamedTuple):
    name: str
    kind: str
    length: str | None  # type of the length of a list


class _Element(NamedTuple):
    name: str
    length: int
    properties: list[_Property]


class List(NamedTuple):
    """Lists: their lengths (n,), and all values one after the other."""

    counts: Ints
    values: Values


Table: TypeAlias = dict[str, Values | List]
Tables: TypeAlias = dict[str, Table]


def read_tables(data: bytes) -> tuple[Tables, list[str]]:
    """Tables by the name of their element, and the names of textures in comments.

    InputError: it is no PLY file, or cut off.
    """
    encoding, elements, textures, start = _header(data)
    rows: _AsciiRows | _BinaryRows
    if encoding == "ascii":
        rows = _AsciiRows(np.array(data[start:].split(), dtype=np.float64))
    else:
        rows = _BinaryRows(data, start, ENCODINGS[encoding])
    return {one.name: _table(one, rows) for one in elements}, textures


def _header(data: bytes) -> tuple[str, list[_Element], list[str], int]:
    """Encoding, elements, names of textures, and where the header ends."""
    if not data.startswith(b"ply") or (end := data.find(b"end_header")) < 0:
        raise InputError("it has no header of a PLY file")
    start = data.find(b"\n", end) + 1 or len(data)
    if data[end + 10 : end + 11] == b"\r" and data[end + 11 : end + 12] != b"\n":
        start = end + 11
    encoding, elements, textures = "", [], list[str]()
    for line in data[:end].decode("latin-1").splitlines()[1:]:
        match line.split():
            case ["format", name, *_]:
                encoding = name
            case ["element", name, length]:
                elements.append(_Element(name, int(length), []))
            case ["property", "list", count, kind, name]:
                elements[-1].properties.append(_Property(name.lower(), TYPES[kind], TYPES[count]))
            case ["property", kind, name]:
                elements[-1].properties.append(_Property(name.lower(), TYPES[kind], None))
            case ["comment", word, *_] if word.lower() == "texturefile":
                textures.append(line.split(None, 2)[2].strip())
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise InputError(f"its header has a line that is not understood: {line!r:.60}")
    if encoding not in ENCODINGS:
        raise InputError(f"its format is {encoding!r:.40}: allowed is {', '.join(ENCODINGS)}")
    return encoding, elements, textures, start


class _AsciiRows:
    """Rows of numbers in a text."""

    def __init__(self, numbers: Floats) -> None:
        self._numbers, self.at = numbers, 0

    def even(self, kinds: list[str], rows: int) -> list[Values]:
        """Columns of rows that are all alike."""
        size = rows * len(kinds)
        part = self._numbers[self.at : self.at + size]
        if len(part) < size:
            raise InputError("it is cut off: copy it again")
        self.at += size
        return [column.astype(kind) for kind, column in zip(kinds, part.reshape(rows, -1).T,
                                                            strict=True)]  # fmt: skip

    def peek(self, skipped: list[str], kind: str) -> int:
        """The number behind some others of the next row."""
        return int(self._numbers[self.at + len(skipped)])


class _BinaryRows:
    """Rows of numbers in bytes."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self._data, self.at, self._order = data, start, order

    def _type(self, kinds: list[str]) -> np.dtype[Any]:
        return np.dtype([(str(k), self._order + kind) for k, kind in enumerate(kinds)])

    def even(self, kinds: list[str], rows: int) -> list[Values]:
        """Columns of rows that are all alike."""
        row = self._type(kinds)
        if self.at + rows * row.itemsize > len(self._data):
            raise InputError("it is cut off: copy it again")
        table = np.frombuffer(self._data, row, rows, self.at)
        self.at += rows * row.itemsize
        return [table[str(k)].astype(kind) for k, kind in enumerate(kinds)]

    def peek(self, skipped: list[str], kind: str) -> int:
        """The number behind some others of the next row."""
        at = self.at + self._type(skipped).itemsize
        return int(np.frombuffer(self._data, self._order + kind, 1, at)[0])


def _table(element: _Element, rows: _AsciiRows | _BinaryRows) -> dict[str, Values | List]:
    """Columns of an element: at once where all its lists are as long as the first, else by row."""
    if element.length == 0:
        return {one.name: _empty(one) for one in element.properties}
    begin = rows.at
    try:
        sizes = _list_sizes(element, rows)
        columns = _named(element, sizes, rows.even(_kinds(element, sizes), element.length))
        if all((one.counts == one.counts[0]).all() for one in columns.values()
               if isinstance(one, List)):  # fmt: skip
            return columns
    except InputError:
        pass  # where lists differ in length, the first says nothing of the others
    rows.at = begin
    parts = list(_rows_one_by_one(element, rows))
    return {one.name: _joined([part[one.name] for part in parts]) for one in element.properties}


def _empty(one: _Property) -> Values | List:
    values = np.zeros(0, dtype=one.kind)
    return values if one.length is None else List(np.zeros(0, dtype=np.int64), values)


def _list_sizes(element: _Element, rows: _AsciiRows | _BinaryRows) -> dict[str, int]:
    """Lengths of the lists of the next row."""
    sizes, before = dict[str, int](), list[str]()
    for name, kind, count in element.properties:
        if count is not None:
            try:
                sizes[name] = rows.peek(before, count)
            except (IndexError, ValueError):
                raise InputError("it is cut off: copy it again") from None
            if not 0 <= sizes[name] <= MOST_ENTRIES:
                raise InputError(f"its list {name} has {sizes[name]} entries: it is damaged")
            before += [count]
        before += [kind] * sizes.get(name, 1)
    return sizes


def _kinds(element: _Element, sizes: Mapping[str, int]) -> list[str]:
    kinds = list[str]()
    for name, kind, count in element.properties:
        kinds += [kind] if count is None else [count] + [kind] * sizes[name]
    return kinds


def _named(
    element: _Element, sizes: Mapping[str, int], columns: list[Values]
) -> dict[str, Values | List]:
    named, at = dict[str, Values | List](), 0
    for name, kind, count in element.properties:
        if count is None:
            named[name], at = columns[at], at + 1
            continue
        values = columns[at + 1 : at + 1 + sizes[name]]
        flat = np.column_stack(values).ravel() if values else np.zeros(0, dtype=kind)
        named[name], at = List(columns[at].astype(np.int64), flat), at + 1 + sizes[name]
    return named


def _rows_one_by_one(element: _Element, rows: _AsciiRows | _BinaryRows) -> Iterator[Table]:
    for _ in range(element.length):
        sizes = _list_sizes(element, rows)
        yield _named(element, sizes, rows.even(_kinds(element, sizes), 1))


def _joined(parts: list[Any]) -> Values | List:
    if not isinstance(parts[0], List):
        return np.concatenate(parts)
    return List(*(np.concatenate([part[k] for part in parts]) for k in range(2)))


def read_ply(path: Path) -> ObjectFile:
    """Read a mesh; InputError: it is no PLY file, cut off, or without facets."""
    return _contents(path, *read_tables(path.read_bytes()))


def _contents(path: Path, tables: dict[str, dict[str, Any]], textures: list[str]) -> ObjectFile:
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    if not {*"xyz"} <= vertex.keys():
        raise InputError("its vertices have no x, y, z")
    points = _stack(vertex, tuple("xyz"))
    corners = next((face[name] for name in CORNERS if isinstance(face.get(name), List)), None)
    if corners is None or len(corners.counts) == 0:
        raise without_facets(len(points))
    index = _checked(corners.values, len(points))
    cut, polygon = triangles(corners.counts, points[index])
    faces = index[cut]
    notes = list[str]()
    normals = _stack(vertex, ("nx", "ny", "nz")) if "nz" in vertex else None
    colours, source = _colours(vertex, face, faces, polygon, notes)
    uv = _coordinates(vertex, face, corners.counts, cut, faces)
    whole = ObjectPart(points, faces, normals, colours, source=source)
    number = face.get("texnumber", np.zeros(len(corners.counts)))[polygon].astype(np.int64)
    parts = _textured(path, whole, uv, number, textures, notes)
    if not any(part.source for part in parts) and (unknown := sorted({*vertex, *face} - KNOWN)):
        notes.append(f"its properties {', '.join(unknown)} are not understood")
    return ObjectFile(parts, notes)


def _stack(table: Mapping[str, Values], names: tuple[str, ...]) -> Floats:
    return np.column_stack([table[name] for name in names]).astype(np.float64)


def _checked(index: Values, count: int) -> Ints:
    found = index.astype(np.int64)
    if len(found) and not (found.min() >= 0 and found.max() < count):
        raise InputError("its facets name corners that do not exist: it is damaged")
    return found


def _colours(
    vertex: Mapping[str, Values], face: Mapping[str, Any], faces: Ints, polygon: Ints,
    notes: list[str],
) -> tuple[Floats | None, str]:  # fmt: skip
    """Colours (f, 3, 3), and whose they are."""
    for where, table in (("vertex", vertex), ("face", face)):
        names = next((names for names in COLOURS if {*names} <= table.keys()), None)
        if names is None:
            continue
        alpha = [table[n] for n in ("alpha", "a", "diffuse_alpha") if n in table]
        if alpha and (shown_shares(alpha[0]) < 1).any():
            notes.append("its transparency is left out")
        shares = shown_shares(np.column_stack([table[name] for name in names]))
        if where == "vertex":
            return shares[faces], "vertex colours"
        return np.repeat(shares[polygon][:, None], 3, axis=1), "face colours"
    return None, ""


def _coordinates(
    vertex: Mapping[str, Values], face: Mapping[str, Any], counts: Ints, cut: Ints, faces: Ints
) -> Floats | None:
    """Places (f, 3, 2) of the facets' corners on a texture."""
    lists = face.get("texcoord")
    if isinstance(lists, List) and np.array_equal(lists.counts, 2 * counts):
        return lists.values.reshape(-1, 2).astype(np.float64)[cut]
    names = next((names for names in COORDINATES if {*names} <= vertex.keys()), None)
    return None if names is None else _stack(vertex, names)[faces]


def _textured(
    path: Path, whole: ObjectPart, uv: Floats | None, number: Ints, textures: list[str],
    notes: list[str],
) -> list[ObjectPart]:  # fmt: skip
    """The mesh by its textures; colours stay where there is none."""
    if uv is None or not textures:
        if uv is not None:
            notes.append("it has texture coordinates, but names no texture (comment TextureFile)")
        elif textures:
            notes.append(f"it names the texture {textures[0]}, but has no texture coordinates")
        return [whole]
    parts = []
    for k in np.unique(number).tolist():
        own = number == k
        name = textures[k] if 0 <= k < len(textures) else textures[0]
        picture: Bytes | None = texture_beside(path, name, notes)
        part = _some(whole, own)
        if picture is not None:
            part = ObjectPart(part.points, part.faces, part.normals, None, uv[own], picture,
                        f"texture {Path(name).name}")  # fmt: skip
        parts.append(part)
    return parts


def _some(whole: ObjectPart, facets: NDArray[np.bool_]) -> ObjectPart:
    colours = None if whole.colours is None else whole.colours[facets]
    return ObjectPart(
        whole.points, whole.faces[facets], whole.normals, colours, source=whole.source
    )
