"""PLY files: meshes with colours and textures, under the names that programs give these."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

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
from tbcad.light.simulate.object_files.ply_tables import List, Values, read_tables
from tbcad.types import Bytes, Floats, Ints

COLOURS = (("red", "green", "blue"), ("r", "g", "b"),
           ("diffuse_red", "diffuse_green", "diffuse_blue"))  # fmt: skip
COORDINATES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))
CORNERS = ("vertex_indices", "vertex_index")
KNOWN = {*"xyz", "nx", "ny", "nz", "alpha", "a", "diffuse_alpha", "texcoord", "texnumber", "flags",
         "quality", "confidence", *CORNERS, *sum(COLOURS, ()), *sum(COORDINATES, ())}  # fmt: skip


def read_ply(path: Path) -> ObjectFile:
    """Read a mesh.

    Raises:
        InputError: it is no PLY file, cut off, or without facets.
    """
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
