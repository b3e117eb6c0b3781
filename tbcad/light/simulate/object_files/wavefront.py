"""OBJ files with their MTL files (Wavefront, Advanced Visualizer, appendix B, 1995)."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    AGAIN,
    BESIDE,
    ROUNDING,
    Fault,
    ObjectFile,
    ObjectPart,
    even,
    file_beside,
    in_range,
    range_text,
    shown_shares,
    text_of,
    textured,
    triangles,
    without_facets,
)
from tbcad.light.simulate.object_files.finish import F0, Finish, dielectric_f0, phong_finish
from tbcad.types import Floats, Ints

OPTIONS = re.compile(r"((?:-[a-z]+(?:\s+(?:on|off|[-+.\de]+|[rgbmlz]))+\s+)*)(.*)", re.IGNORECASE)
# Of MTL's keys with numbers: how many, least and largest. Kd to Ni are of the specification above,
# Pr and what follows of its extension for physically based rendering (D. Neubelt and others, 2015).
NUMBERS: dict[str, tuple[tuple[int, ...], float, float]] = {
    **dict.fromkeys(("kd", "ks"), ((1, 3), 0.0, 1 + ROUNDING)),
    "ke": ((1, 3), 0.0, np.inf), "ns": ((1,), 0.0, np.inf), "ni": ((1,), 0.0, 10.0),
    **dict.fromkeys(("d", "tr", "pr", "pm", "ps", "pc"), ((1,), 0.0, 1.0)),
    "illum": ((1,), 0.0, 10.0), "aniso": ((1,), -1.0, 1.0),
}  # fmt: skip
# What is not converted, and the value with which it changes nothing.
NOT_CONVERTED = {
    "d": ("transparency", 1.0), "tr": ("transparency", 0.0), "ke": ("light (Ke)", 0.0),
    "ps": ("sheen (Ps)", 0.0), "pc": ("clear coat (Pc)", 0.0), "aniso": ("anisotropy", 0.0),
}  # fmt: skip
# Of no weight without those, or for rays that go to the camera at once.
HARMLESS = {"ka", "tf", "sharpness", "pcr", "anisor"}
TABLES = ("v", "vt", "vn")
LEFT_OUT = {"l": "lines", "p": "points", "curv": "curves", "curv2": "curves", "surf": "surfaces"}


@dataclass
class _Material:
    """A material: its colour, the file of its picture, and how it shines."""

    colour: list[float] | None = None
    picture: str | None = None
    specular: list[float] | None = None
    numbers: dict[str, float] = field(default_factory=dict)  # ns, ni, pr, pm and illum

    def finish(self, facets: int) -> Finish | None:
        """How facets shine: by Pr and Pm, else by Ns and Ks; None: matt, as illum 0 and 1 say."""
        told = self.numbers
        if told.keys() & {"pr", "pm"}:
            # many programs write an index of 1 or 0, which nothing solid has, where they know none
            f0 = dielectric_f0(told["ni"]) if told.get("ni", 1.0) > 1 else F0
            return Finish.even(facets, told.get("pr", 1.0), told.get("pm", 0.0), f0)
        shines = self.specular is not None and max(self.specular) > 0 and "ns" in told
        if not shines or self.specular is None or told.get("illum", 2) < 2:
            return None
        return phong_finish(facets, told["ns"], self.specular)


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
    vertices, normals = _table(tables, "v", 3), _table(tables, "vn", 3)[:, :3]
    uv = _table(tables, "vt", 2)[:, :2]
    # many programs write colours behind places: v x y z r g b
    colours = shown_shares(vertices[:, -3:]) if vertices.shape[1] in (6, 7) else None
    counts, index = _corners(facets, [len(tables[name]) for name in TABLES])
    cut, polygon = triangles(counts, vertices[index[:, 0], :3])
    materials = _materials(path, tables["mtllib"], notes)
    names, which = np.unique(np.array(facets.material), return_inverse=True)
    parts = []
    for k, name in enumerate(names.tolist()):
        if name and materials is not None and name not in materials:
            notes.append(Fault(f"its material {name} is in no MTL file: {AGAIN}"))
        own = index[cut[which[polygon] == k]]
        part = _part(vertices[:, :3], normals, own)
        if colours is not None:
            part = replace(part, colours=colours[own[..., 0]], source="vertex colours")
        on = uv[own[..., 1]] if len(uv) and not (own[..., 1] < 0).any() else None
        parts.append(_painted(path, part, on, (materials or {}).get(name, _Material()), notes))
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
    tokens = (token + "//" for corners in facets.corners for token in corners)
    numbers = [int(number or 0) for token in tokens for number in token.split("/")[:3]]
    index = np.array(numbers, dtype=np.int64).reshape(-1, 3)
    known = np.repeat(np.array(facets.known, dtype=np.int64), counts, axis=0)
    index = np.where(index > 0, index - 1, np.where(index < 0, known + index, -1))
    if (index[:, 0] < 0).any() or (index >= limits).any() or (index < -1).any():
        raise InputError("its facets name corners that do not exist: it is damaged")
    return counts, index


def _part(points: Floats, normals: Floats, index: Ints) -> ObjectPart:
    """Facets by vertex, texture place and normal of their corners, (f, 3, 3)."""
    key = index[..., 0].ravel() * (len(normals) + 1) + index[..., 2].ravel() + 1
    own, faces = np.unique(key, return_inverse=True)
    vertex, normal = np.divmod(own, len(normals) + 1)
    shaded = np.concatenate([np.zeros((1, 3)), normals])[normal] if len(normals) else None
    return ObjectPart(points[vertex], faces.reshape(-1, 3), shaded)


def _painted(
    path: Path, part: ObjectPart, uv: Floats | None, material: _Material, notes: list[str]
) -> ObjectPart:
    """The part with its texture, else colours of its corners, else its material's."""
    part = replace(part, finish=material.finish(len(part.faces)))
    if not part.source and material.colour is not None:
        colours = even(material.colour, len(part.faces))
        part = replace(part, colours=colours, source="colours of materials (Kd)")
    if material.picture is not None:
        return textured(path, part, uv, material.picture, notes)
    if uv is not None and not part.source:
        notes.append("it has texture coordinates, but names no texture (map_Kd)")
    return part


def _materials(path: Path, libraries: list[str], notes: list[str]) -> dict[str, _Material] | None:
    """Materials by name; None where the file names no file of them that is there."""
    found = dict[str, _Material]()
    files = [file for names in libraries for file in _files(path, names, notes)]
    for file in files:
        _read_materials(file, found, notes)
    return found if files else None


def _files(path: Path, names: str, notes: list[str]) -> Iterator[Path]:
    """The files that a line names: one whose name may have spaces, else one a word."""
    try:
        yield file_beside(path, names)
    except InputError:
        for name in names.split():
            try:
                yield file_beside(path, name)
            except InputError as error:
                notes.append(Fault(f"its materials {error}: {BESIDE}"))


def _read_materials(file: Path, found: dict[str, _Material], notes: list[str]) -> None:
    material = _Material()
    for number, line in enumerate(text_of(file.read_bytes()).splitlines(), 1):
        word, _, rest = line.strip().replace("\t", " ").partition(" ")
        key, rest = word.lower(), rest.strip()
        if key in NUMBERS:
            _take_numbers(material, key, rest, notes, f"{file.name}, line {number}: {word}")
        elif key == "newmtl":
            material = found.setdefault(rest, _Material())
        elif key == "map_kd" and rest and (match := OPTIONS.fullmatch(rest)):
            material.picture = match[2].strip()
            if match[1]:
                notes.append(f"options of a texture are left out: {match[1].strip()}")
        elif key and key not in HARMLESS and not key.startswith("#"):
            notes.append(f"its {word:.40} is left out")


def _take_numbers(material: _Material, key: str, text: str, notes: list[str], where: str) -> None:
    """Numbers of a line before its comment into a material; a fault where they cannot be."""
    counts, low, high = NUMBERS[key]
    words = text.partition("#")[0].split()
    numbers = in_range([_real(word) for word in words if word != "-halo"], counts, low, high)
    if numbers is None:
        three = " or three" if 3 in counts else ""
        allowed = range_text(low, round(high, 2)) + three
        notes.append(Fault(f"{where} is {text:.40}, allowed is {allowed}: mend it"))
    elif key == "kd":
        material.colour = _three(numbers)
    elif key == "ks":
        material.specular = _three(numbers)
    elif key not in NOT_CONVERTED:
        material.numbers[key] = numbers[0]
    elif any(number != NOT_CONVERTED[key][1] for number in numbers):
        notes.append(f"its {NOT_CONVERTED[key][0]} is left out")


def _three(numbers: list[float]) -> list[float]:
    """Red, green and blue; one number is grey."""
    return [min(number, 1.0) for number in numbers * (3 // len(numbers))]


def _real(word: str) -> float:
    """NaN where a word is no number."""
    try:
        return float(word)
    except ValueError:
        return math.nan
