"""OBJ files with their MTL files (Wavefront, Advanced Visualizer, appendix B, 1995)."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

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
LEFT_OUT = {"l": "lines", "p": "points", "curv": "curves", "curv2": "curves", "surf": "surfaces"}


@dataclass
class _Material:
    """A material: its colour, and the file of its picture."""

    colour: list[float] | None = None
    picture: str | None = None


@dataclass
class _Lines:
    """The lines of a file by their kind; facets with the material in force."""

    v: list[str] = field(default_factory=list)
    vt: list[str] = field(default_factory=list)
    vn: list[str] = field(default_factory=list)
    facets: list[str] = field(default_factory=list)
    material: list[str | None] = field(default_factory=list)
    known: list[tuple[int, int, int]] = field(default_factory=list)
    libraries: list[str] = field(default_factory=list)
    left_out: set[str] = field(default_factory=set)


def read_obj(path: Path) -> ObjectFile:
    """Read a mesh, a part for each material.

    InputError: it is no OBJ file, or its facets name corners that do not exist.
    """
    lines = _lines(text_of(path.read_bytes()))
    notes = [f"its {what} are left out" for what in sorted(lines.left_out)]
    if not lines.facets:
        raise without_facets(len(lines.v))
    vertices = _table(lines.v, "v", 3)
    points, colours = vertices[:, :3], _vertex_colours(vertices)
    counts, index = _corners(lines)
    faces, polygon = triangles(counts, points[index[:, 0]])
    materials = _materials(path, lines.libraries, notes)
    names, which = np.unique(np.array([m or "" for m in lines.material]), return_inverse=True)
    parts = []
    for k, name in enumerate(names.tolist()):
        own = index[faces[which[polygon] == k]]
        parts.append(_part(path, lines, points, colours, own, name, materials, notes))
    return ObjectFile([part for part in parts if len(part.faces)], list(dict.fromkeys(notes)))


def _lines(text: str) -> _Lines:
    found, material = _Lines(), None
    for line in text.replace("\\\r\n", " ").replace("\\\n", " ").splitlines():
        key, _, rest = line.strip().replace("\t", " ").partition(" ")
        match key:
            case "v":
                found.v.append(rest)
            case "vt":
                found.vt.append(rest)
            case "vn":
                found.vn.append(rest)
            case "f" | "fo":
                found.facets.append(rest.partition("#")[0])
                found.material.append(material)
                found.known.append((len(found.v), len(found.vt), len(found.vn)))
            case "usemtl":
                material = rest.strip()
            case "mtllib":
                found.libraries.append(rest.strip())
            case _ if key in LEFT_OUT:
                found.left_out.add(LEFT_OUT[key])
    return found


def _table(lines: list[str], what: str, columns: int) -> Floats:
    """Numbers of lines, (n, columns or more); short lines are refused, others cut to the least."""
    rows = [line.partition("#")[0].split() for line in lines]
    width = min((len(row) for row in rows), default=columns)
    if width < columns:
        raise InputError(f"a line of {what} has fewer than {columns} numbers")
    return np.array([row[:width] for row in rows], dtype=np.float64).reshape(-1, width)


def _vertex_colours(vertices: Floats) -> Floats | None:
    """Colours (v, 3) behind places, as many programs write them: v x y z r g b."""
    return shown_shares(vertices[:, -3:]) if vertices.shape[1] in (6, 7) else None


def _corners(lines: _Lines) -> tuple[Ints, Ints]:
    """Corners of each polygon (p,), and of them all vertex, texture place and normal, (c, 3).

    Numbers are from 0; -1 where there is none. Negative ones in the file count back from the line.
    """
    split = [line.split() for line in lines.facets]
    counts = np.array([len(corners) for corners in split], dtype=np.int64)
    index = _index([token for corners in split for token in corners])
    known = np.repeat(np.array(lines.known, dtype=np.int64), counts, axis=0)
    index = np.where(index > 0, index - 1, np.where(index < 0, known + index, -1))
    limits = np.array([len(lines.v), len(lines.vt), len(lines.vn)])
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


def _part(
    path: Path, lines: _Lines, points: Floats, colours: Floats | None, index: Ints, name: str,
    materials: dict[str, _Material] | None, notes: list[str],
) -> ObjectPart:  # fmt: skip
    """Facets of one material; index (f, 3, 3) by corner, and vertex, texture place and normal."""
    key = index[..., 0].ravel() * (len(lines.vn) + 1) + index[..., 2].ravel() + 1
    own, faces = np.unique(key, return_inverse=True)
    vertex, normal = np.divmod(own, len(lines.vn) + 1)
    normals = np.concatenate([np.zeros((1, 3)), _table(lines.vn, "vn", 3)[:, :3]])[normal]
    part = ObjectPart(points[vertex], faces.reshape(-1, 3), normals if lines.vn else None)
    uv = _coordinates(lines, index)
    return _coloured(path, part, uv, colours, vertex, name, materials, notes)


def _coordinates(lines: _Lines, index: Ints) -> Floats | None:
    if not lines.vt or (index[..., 1] < 0).any():
        return None
    return _table(lines.vt, "vt", 2)[:, :2][index[..., 1]]


def _coloured(
    path: Path, part: ObjectPart, uv: Floats | None, colours: Floats | None, own: Ints, name: str,
    materials: dict[str, _Material] | None, notes: list[str],
) -> ObjectPart:  # fmt: skip
    """The part with its texture, else colours of its corners, else its material's."""
    material = (materials or {}).get(name, _Material())
    if name and materials is not None and name not in materials:
        notes.append(f"its material {name} is in no MTL file")
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
        return replace(part, colours=colours[own][part.faces], source="vertex colours")
    if material.colour is not None:
        return replace(part, colours=even(material.colour, len(part.faces)),
                     source="colours of materials (Kd)")  # fmt: skip
    return part


def _materials(path: Path, libraries: list[str], notes: list[str]) -> dict[str, _Material] | None:
    """Materials by name; None where the file names no file of them that is there."""
    found = dict[str, _Material]()
    files = 0
    for names in libraries:
        try:
            files_named = [file_beside(path, names)]
        except InputError:
            files_named = []
            for name in names.split():
                try:
                    files_named.append(file_beside(path, name))
                except InputError as error:
                    notes.append(f"its materials {error}")
        for file in files_named:
            files += 1
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
