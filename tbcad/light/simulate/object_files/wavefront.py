"""OBJ files with their MTL files (Wavefront, Advanced Visualizer, appendix B, 1995)."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    ROUNDING,
    ObjectFile,
    ObjectPart,
    even,
    file_beside,
    shown_shares,
    text_of,
    texture_beside,
    triangles,
    without_facets,
)
from tbcad.types import Floats, Ints

OPTIONS = re.compile(r"((?:-[a-z]+(?:\s+(?:on|off|[-+.\de]+|[rgbmlz]))+\s+)*)(.*)", re.IGNORECASE)
IGNORED = {"bump", "norm", "disp", "refl", "map_bump", "map_ks", "map_ke", "map_d", "map_ns",
           "map_pr", "map_pm", "map_ka", "decal"}  # fmt: skip
TABLES = ("v", "vt", "vn")
LEFT_OUT = {"l": "lines", "p": "points", "curv": "curves", "curv2": "curves", "surf": "surfaces"}


@dataclass
class _Material:
    """A material: its colour, and the file of its picture."""

    colour: list[float] | None = None
    picture: str | None = None


class _Facets(NamedTuple):
    """Lines of facets, the material in force at each, and how many v, vt and vn are before it."""

    corners: list[list[str]]
    material: list[str]
    known: list[tuple[int, ...]]


def read_obj(path: Path) -> ObjectFile:
    """Read a mesh, a part for each material.

    InputError: it is no OBJ file, or its facets name corners that do not exist.
    """
    tables: dict[str, list[str]] = {"v": [], "vt": [], "vn": [], "mtllib": []}
    facets, left_out, material = _Facets([], [], []), set[str](), ""
    text = text_of(path.read_bytes())
    for line in text.replace("\\\r\n", " ").replace("\\\n", " ").splitlines():
        key, _, rest = line.strip().replace("\t", " ").partition(" ")
        if key in tables:
            tables[key].append(rest.strip())
        elif key in {"f", "fo"}:
            facets.corners.append(rest.partition("#")[0].split())
            facets.material.append(material)
            facets.known.append(tuple(len(tables[name]) for name in TABLES))
        elif key == "usemtl":
            material = rest.strip()
        elif key in LEFT_OUT:
            left_out.add(LEFT_OUT[key])
    notes = [f"its {what} are left out" for what in sorted(left_out)]
    if not facets.corners:
        raise without_facets(len(tables["v"]))
    vertices = _table(tables, "v", 3)
    # many programs write colours behind places: v x y z r g b
    colours = shown_shares(vertices[:, -3:]) if vertices.shape[1] in (6, 7) else None
    counts, index = _corners(facets, [len(tables[name]) for name in TABLES])
    faces, polygon = triangles(counts, vertices[index[:, 0], :3])
    materials = _materials(path, tables["mtllib"], notes)
    names, which = np.unique(np.array(facets.material), return_inverse=True)
    parts = []
    for k, name in enumerate(names.tolist()):
        own = index[faces[which[polygon] == k]]
        part, vertex = _part(tables, vertices[:, :3], own)
        uv = None
        if tables["vt"] and not (own[..., 1] < 0).any():
            uv = _table(tables, "vt", 2)[:, :2][own[..., 1]]
        if name and materials is not None and name not in materials:
            notes.append(f"its material {name} is in no MTL file")
        corner = None if colours is None else colours[vertex][part.faces]
        used = (materials or {}).get(name, _Material())
        parts.append(_coloured(path, part, uv, corner, used, notes))
    return ObjectFile([part for part in parts if len(part.faces)], list(dict.fromkeys(notes)))


def _table(tables: dict[str, list[str]], name: str, columns: int) -> Floats:
    """Numbers of lines, (n, columns or more); short lines are refused, others cut to the least."""
    rows = [line.partition("#")[0].split() for line in tables[name]]
    width = min((len(row) for row in rows), default=columns)
    if width < columns:
        raise InputError(f"a line of {name} has fewer than {columns} numbers")
    return np.array([row[:width] for row in rows], dtype=np.float64).reshape(-1, width)


def _corners(facets: _Facets, limits: list[int]) -> tuple[Ints, Ints]:
    """Corners of each polygon (p,), and of them all vertex, texture place and normal, (c, 3).

    Numbers are from 0; -1 where there is none. Negative ones in the file count back from the line.
    """
    counts = np.array([len(corners) for corners in facets.corners], dtype=np.int64)
    index = _index([token for corners in facets.corners for token in corners])
    known = np.repeat(np.array(facets.known, dtype=np.int64), counts, axis=0)
    index = np.where(index > 0, index - 1, np.where(index < 0, known + index, -1))
    if (index[:, 0] < 0).any() or (index >= limits).any() or (index < -1).any():
        raise InputError("its facets name corners that do not exist: it is damaged")
    return counts, index


def _index(tokens: list[str]) -> Ints:
    """Numbers (c, 3) of corners as 1/2/3, 1//3, 1/2 or 1; 0 where there is none."""
    slashes = {token.count("/") for token in tokens}
    numbers = " ".join(tokens).replace("//", "/0/").replace("/", " ").split()
    index = np.zeros((len(tokens), 3), dtype=np.int64)
    width = 1 + max(slashes, default=0)
    if len(slashes) == 1 and len(numbers) == width * len(tokens) and width <= 3:
        index[:, :width] = np.array(list(map(int, numbers))).reshape(-1, width)
        return index
    for row, token in enumerate(tokens):
        parts = token.split("/")[:3]
        index[row, : len(parts)] = [int(part or 0) for part in parts]
    return index


def _part(tables: dict[str, list[str]], points: Floats, index: Ints) -> tuple[ObjectPart, Ints]:
    """Facets by corner, and vertex, texture place and normal, (f, 3, 3); and their vertices."""
    normals = np.concatenate([np.zeros((1, 3)), _table(tables, "vn", 3)[:, :3]])
    key = index[..., 0].ravel() * len(normals) + index[..., 2].ravel() + 1
    own, faces = np.unique(key, return_inverse=True)
    vertex, normal = np.divmod(own, len(normals))
    shaded = normals[normal] if tables["vn"] else None
    return ObjectPart(points[vertex], faces.reshape(-1, 3), shaded), vertex


def _coloured(
    path: Path, part: ObjectPart, uv: Floats | None, colours: Floats | None, material: _Material,
    notes: list[str],
) -> ObjectPart:  # fmt: skip
    """The part with its texture, else colours of its corners, else its material's."""
    if material.picture is not None and uv is None:
        notes.append(f"it names the texture {material.picture}, but has no texture coordinates")
    elif material.picture is not None:
        picture = texture_beside(path, material.picture, notes)
        if picture is not None:
            file = material.picture.replace("\\", "/").rpartition("/")[2]
            return replace(part, uv=uv, picture=picture, source=f"texture {file}")
    elif uv is not None and material.colour is None and colours is None:
        notes.append("it has texture coordinates, but names no texture (map_Kd)")
    if colours is not None:
        return replace(part, colours=colours, source="vertex colours")
    if material.colour is not None:
        return replace(part, colours=even(material.colour, len(part.faces)),
                     source="colours of materials (Kd)")  # fmt: skip
    return part


def _materials(path: Path, libraries: list[str], notes: list[str]) -> dict[str, _Material] | None:
    """Materials by name; None where the file names no file of them that is there."""
    found = dict[str, _Material]()
    files = list[Path]()
    for names in libraries:
        try:
            files.append(file_beside(path, names))
        except InputError:
            for name in names.split():
                try:
                    files.append(file_beside(path, name))
                except InputError as error:
                    notes.append(f"its materials {error}")
    for file in files:
        _read_materials(file, found, notes)
    return found if files else None


def _read_materials(file: Path, found: dict[str, _Material], notes: list[str]) -> None:
    material = _Material()
    for line in text_of(file.read_bytes()).splitlines():
        key, _, rest = line.strip().replace("\t", " ").partition(" ")
        key, rest = key.lower(), rest.strip()
        match key:
            case "newmtl":
                material = found.setdefault(rest, _Material())
            case "kd":
                material.colour = _colour(rest, notes)
            case "map_kd" if rest:
                options, material.picture = _picture(rest)
                if options:
                    notes.append(f"options of a texture are left out: {options}")
            case "d" | "tr":
                if _is_transparent(key, rest):
                    notes.append("its transparency is left out")
            case "ke":
                if any(number not in {"0", "0.0"} and _number(number) > 0
                       for number in rest.split()):  # fmt: skip
                    notes.append("light of its materials (Ke) is left out")
            case _ if key in IGNORED:
                notes.append(f"its {line.split()[0]} is left out")


def _picture(text: str) -> tuple[str, str]:
    match = OPTIONS.fullmatch(text)
    return (match[1].strip(), match[2].strip()) if match else ("", text)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def _is_transparent(key: str, rest: str) -> bool:
    numbers = rest.split()
    opaque = {"d": 1.0, "tr": 0.0}[key]
    return bool(numbers) and numbers[0][0].isdigit() and _number(numbers[0]) != opaque


def _colour(text: str, notes: list[str]) -> list[float] | None:
    """Red, green and blue; one number is grey."""
    try:
        numbers = [float(number) for number in text.partition("#")[0].split()]
    except ValueError:
        numbers = []
    numbers = numbers * 3 if len(numbers) == 1 else numbers
    if len(numbers) != 3 or not all(0 <= number <= 1 + ROUNDING for number in numbers):
        notes.append(f"its colour Kd {text:.40} is not understood: allowed are three of 0 to 1")
        return None
    return [min(number, 1.0) for number in numbers]
