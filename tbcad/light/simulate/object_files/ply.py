"""PLY files (G. Turk, The PLY Polygon File Format, 1994), text and binary; OFF files as tables."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    ObjectFile,
    ObjectPart,
    shown_shares,
    text_of,
    textured,
    triangles,
    without_facets,
)
from tbcad.types import Floats, Ints

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
OFF = re.compile(r"(ST)?(C)?(N)?OFF\b")
ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
CUT_OFF = "it is cut off: copy it again"
MOST_ENTRIES = 1 << 20  # of a list
Values: TypeAlias = NDArray[Any]
COLOURS = (("red", "green", "blue"), ("r", "g", "b"),
           ("diffuse_red", "diffuse_green", "diffuse_blue"))  # fmt: skip
COORDINATES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))
NORMALS = ("nx", "ny", "nz")
CORNERS = ("vertex_indices", "vertex_index")
KNOWN = {*"xyz", *NORMALS, "alpha", "a", "diffuse_alpha", "texcoord", "texnumber", "flags",
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


Table = dict[str, Any]  # columns by name: Values or List


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


def _table(one: _Element, data: bytes, at: int, order: str) -> tuple[Table, int]:
    """Columns of an element at a place in the data, and where it ends.

    At once where all its lists are as long as those of the first row, else row by row.
    """
    parts = list[Values]()
    try:
        parts = [_rows(one, one.length, data, at, order)] if one.length else []
        lists = [
            part[_count(name)] for part in parts for name, _, length in one.properties if length
        ]
        alike = all((counts == counts[0]).all() for counts in lists)
    except InputError:
        alike = False  # where lists differ in length, the first says nothing of the others
    if not alike:
        parts, end = [], at
        for _ in range(one.length):
            parts.append(_rows(one, 1, data, end, order))
            end += parts[-1].nbytes
    table = Table()
    for name, kind, length in one.properties:
        values = [part[name].astype(kind).ravel() for part in parts]
        table[name] = np.concatenate([np.zeros(0, dtype=kind), *values])
        if length:
            counts = [part[_count(name)].astype(np.int64) for part in parts]
            table[name] = List(np.concatenate([np.zeros(0, dtype=np.int64), *counts]), table[name])
    return table, at + sum(part.nbytes for part in parts)


def _rows(one: _Element, count: int, data: bytes, at: int, order: str) -> Values:
    """Rows that are all as the first, as fields by name; InputError: there are not so many."""
    fields = list[Any]()
    for name, kind, length in one.properties:
        if length is None:
            fields.append((name, _stored(kind, order)))
            continue
        place, stored = at + np.dtype(fields).itemsize, np.dtype(_stored(length, order))
        if place + stored.itemsize > len(data):
            raise InputError(CUT_OFF)
        size = int(np.frombuffer(data, stored, 1, place)[0])
        if not 0 <= size <= MOST_ENTRIES:
            raise InputError(f"its list {name} has {size} entries: it is damaged")
        fields += [(_count(name), stored), (name, _stored(kind, order), (size,))]
    row = np.dtype(fields)
    if at + count * row.itemsize > len(data):
        raise InputError(CUT_OFF)
    return np.frombuffer(data, row, count, at)


def _count(name: str) -> str:
    """The field of the length of a list."""
    return f"number of {name}"


def _stored(kind: str, order: str) -> str:
    return order + kind if order else "f8"


def read_ply(path: Path) -> ObjectFile:
    """Read a mesh; InputError: it is no PLY file, cut off, or without facets."""
    data = path.read_bytes()
    encoding, elements, textures, at = _header(data)
    order = ENCODINGS[encoding]
    if encoding == "ascii":  # as if all of its numbers were stored as real ones
        data, at = np.array(data[at:].split(), dtype=np.float64).tobytes(), 0
    tables = dict[str, Table]()
    for one in elements:
        tables[one.name], at = _table(one, data, at, order)
    return _mesh(path, tables, textures, [])


def read_off(path: Path) -> ObjectFile:
    """Read a mesh; InputError: it is no OFF file of text in three dimensions, or cut off."""
    text = text_of(path.read_bytes())
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    lines = [line for line in lines if line]
    match = OFF.match(lines[0]) if lines else None
    if match is None or "BINARY" in lines[0]:
        raise InputError("its first line is not OFF, COFF, NOFF, STOFF: write it as text")
    rest = lines[0][match.end() :].strip()
    lines = [rest, *lines[1:]] if rest else lines[1:]
    points, facets = (int(number) for number in lines[0].split()[:2])
    rows = [line.split() for line in lines[1 : 1 + points + facets]]
    if len(rows) < points + facets:
        raise InputError(CUT_OFF)
    vertices, polygons = rows[:points], rows[points:]
    names = [*"xyz", *NORMALS] if match[3] else [*"xyz"]
    vertex, notes = _columns(vertices, names), list[str]()
    counts = [int(row[0]) for row in polygons]
    index = [int(n) for row, k in zip(polygons, counts, strict=True) for n in row[1 : 1 + k]]
    face: Table = {CORNERS[0]: List(np.array(counts), np.array(index))}
    own = [row[1 + k :] for row, k in zip(polygons, counts, strict=True)]
    widths = {len(row) for row in own}
    if match[2]:
        vertex |= _columns([row[len(names) :] for row in vertices], COLOURS[0])
    elif widths <= {3, 4}:
        face |= _columns(own, (*COLOURS[0], *["alpha"] * (widths == {4})))
    elif widths != {0}:
        notes.append("colours of some of its faces only, or by a colour map, are left out")
    return _mesh(path, {"vertex": vertex, "face": face}, [], notes)


def _columns(rows: list[list[str]], names: Sequence[str]) -> Table:
    """The first columns of text: whole numbers if none has a point, else real ones."""
    cells = [row[: len(names)] for row in rows]
    if any(len(row) < len(names) for row in cells):
        raise InputError(f"one of its lines has fewer numbers than {' '.join(names)}")
    values = np.array(cells, dtype=np.float64).reshape(-1, len(names))
    real = any("." in number for row in cells for number in row) or (values % 1 != 0).any()
    return dict(zip(names, values.astype(np.float64 if real else np.int64).T, strict=True))


def _mesh(
    path: Path, tables: dict[str, Table], textures: list[str], notes: list[str]
) -> ObjectFile:
    vertex, face = tables.get("vertex", {}), tables.get("face", {})
    if not {*"xyz"} <= vertex.keys():
        raise InputError("its vertices have no x, y, z")
    points = _stack(vertex, tuple("xyz"))
    corners = next((face[name] for name in CORNERS if isinstance(face.get(name), List)), None)
    if corners is None or len(corners.counts) == 0:
        raise without_facets(len(points))
    index = corners.values.astype(np.int64)
    if len(index) != corners.counts.sum() or ((index < 0) | (index >= len(points))).any():
        raise InputError("its facets name corners that do not exist: it is damaged")
    cut, polygon = triangles(corners.counts, points[index])
    faces = index[cut]
    normals = _stack(vertex, NORMALS) if "nz" in vertex else None
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
    if not textures:
        if uv is not None:
            notes.append("it has texture coordinates, but names no texture (comment TextureFile)")
        return [whole]
    if uv is None:
        return [textured(path, whole, uv, textures[0], notes)]
    parts = []
    for k in np.unique(number).tolist():
        own = number == k
        name = textures[k] if 0 <= k < len(textures) else textures[0]
        colours = None if whole.colours is None else whole.colours[own]
        part = replace(whole, faces=whole.faces[own], colours=colours)
        parts.append(textured(path, part, uv[own], name, notes))
    return parts
