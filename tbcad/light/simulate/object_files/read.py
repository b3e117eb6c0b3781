"""An object's file of any format that is read, STL and OFF here; others are refused with advice."""

import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    ObjectFile,
    ObjectPart,
    shown_shares,
    text_of,
    triangles,
    without_facets,
)
from tbcad.types import Floats, Ints

MAX_FILE_BYTES = 1 << 30  # bytes
FORMATS = "PLY, STL, OBJ, OFF, GLB, glTF, 3MF"
_SOLID = "is a solid, no mesh: write it as STL or 3MF, as FreeCAD does, or tbcad's own build"
_PACKED = "is packed: unpack it, and name the mesh in it"
_SCENE = "is not read: open it in Blender and export it as GLB"
_CLOUD = "is a cloud of points: make a mesh of it, as MeshLab does (screened Poisson)"
_REFUSED = {
    _SOLID: "step stp iges igs brep brp x_t sat sldprt ipt f3d fcstd",
    _PACKED: "gz zip bz2 xz 7z tar tgz zst rar",
    _SCENE: "dae fbx blend usd usda usdc usdz abc x3d wrl wrz 3ds max ma mb c4d lwo 3dxml vtk vtp "
    "amf skp dxf ctm msh xaml gltf1 drc",
    _CLOUD: "pcd las laz xyz pts ptx e57 splat spz",
}
_WHY_NOT = {f".{end}": why for why, ends in _REFUSED.items() for end in ends.split()}
_GZIP, _ZIP = b"\x1f\x8b", b"PK\x03\x04"
HEADER_BYTES = 80
OWN_COLOUR = 0x8000  # bit of VisCAM; Materialise sets it where the whole part's colour holds
HEADER = re.compile(r"(ST)?(C)?(N)?OFF\b")


def read_object_file(path: Path) -> ObjectFile:
    """Read an object's file as it is.

    InputError: it is not there, in no format that is read, damaged, or without facets.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a triangle mesh ({FORMATS})")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise InputError(f"{path} is over 1 GiB: reduce the mesh first")
    read = _reader(path)
    try:
        return read(path)
    except InputError as error:
        raise InputError(f"{path} cannot be read as a mesh: {error}") from None
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OverflowError,
            RuntimeError, MemoryError, OSError) as error:  # fmt: skip
        reason = f"{type(error).__name__}: {error}".rstrip(": ")
        raise InputError(
            f"{path} cannot be read as a mesh: it is damaged ({reason:.120}): name another"
        ) from error


def _reader(path: Path) -> Callable[[Path], ObjectFile]:
    """The reader of a format; modules are loaded when they are needed."""
    kind = path.suffix.lower()
    if kind in _WHY_NOT:
        raise InputError(f"{path} {_WHY_NOT[kind]}")
    with path.open("rb") as file:
        head = file.read(4)
    if head[:2] == _GZIP or (head == _ZIP and kind != ".3mf"):
        raise InputError(f"{path} {_PACKED}")
    match kind:
        case ".ply":
            from tbcad.light.simulate.object_files.ply import read_ply as read
        case ".stl":
            from tbcad.light.simulate.object_files.read import read_stl as read
        case ".obj":
            from tbcad.light.simulate.object_files.wavefront import read_obj as read
        case ".off" | ".coff":
            from tbcad.light.simulate.object_files.read import read_off as read
        case ".glb" | ".gltf":
            from tbcad.light.simulate.object_files.gltf import read_gltf as read
        case ".3mf":
            from tbcad.light.simulate.object_files.threemf import read_3mf as read
        case _:
            raise InputError(f"{path} cannot be read as a mesh: give {FORMATS}")
    return read


def read_stl(path: Path) -> ObjectFile:
    """Read a mesh, shaded flat; InputError: it is no STL file, or cut off."""
    from trimesh.exchange.stl import load_stl

    data = path.read_bytes()
    found = load_stl(BytesIO(data))
    solids = found["geometry"].values() if "geometry" in found else [found]
    parts = [_part(data[:HEADER_BYTES], solid) for solid in solids if "faces" in solid]
    if not parts:
        if len(data) > HEADER_BYTES + 4:
            raise InputError("its length is not what its number of facets says: copy it again")
        raise without_facets(0)
    return ObjectFile(parts)


def _part(header: bytes, solid: dict[str, Any]) -> ObjectPart:
    points = np.asarray(solid["vertices"], dtype=np.float64)
    faces = np.asarray(solid["faces"], dtype=np.int64)
    words = solid.get("face_attributes", {}).get("stl")
    colours = None if words is None else _colours(header, np.asarray(words, dtype=np.int64))
    return ObjectPart(
        points, faces, None, colours, source="" if colours is None else "face colours"
    )


def _colours(header: bytes, words: NDArray[np.int64]) -> Floats | None:
    """Colours (f, 3, 3) of facets' words (f,), five bits a channel; None where none has any."""
    channels = np.stack([words & 31, words >> 5 & 31, words >> 10 & 31], axis=-1) / 31
    at = header.find(b"COLOR=")
    if at >= 0 and len(header) >= at + 9:
        whole = np.frombuffer(header, np.uint8, 3, at + 6) / 255
        shares = np.where((words & OWN_COLOUR)[:, None] > 0, whole, channels)
    elif (words & OWN_COLOUR).all():
        shares = channels[:, ::-1]
    else:
        return None
    return np.repeat(shares[:, None], 3, axis=1)


def read_off(path: Path) -> ObjectFile:
    """Read a mesh; InputError: it is no OFF file of text in three dimensions, or cut off."""
    text = text_of(path.read_bytes())
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    lines = [line for line in lines if line]
    match = HEADER.match(lines[0]) if lines else None
    if match is None or "BINARY" in lines[0]:
        raise InputError("its first line is not OFF, COFF, NOFF, STOFF: write it as text")
    rest = lines[0][match.end() :].strip()
    lines = [rest, *lines[1:]] if rest else lines[1:]
    count, facets = (int(number) for number in lines[0].split()[:2])
    rows = [line.split() for line in lines[1 : 1 + count + facets]]
    if len(rows) < count + facets:
        raise InputError("it is cut off: copy it again")
    if facets == 0:
        raise without_facets(count)
    return _contents(rows[:count], rows[count:], bool(match[2]), bool(match[3]))


def _contents(
    vertices: list[list[str]], polygons: list[list[str]], coloured: bool, with_normals: bool
) -> ObjectFile:
    numbers = np.array([row[:3] for row in vertices], dtype=np.float64)
    at = 6 if with_normals else 3
    normals = np.array([row[3:6] for row in vertices], np.float64) if with_normals else None
    counts = np.array([int(row[0]) for row in polygons])
    flat = np.array([int(i) for row, k in zip(polygons, counts, strict=True)
                     for i in row[1 : 1 + k]])  # fmt: skip
    if len(flat) != counts.sum() or flat.min() < 0 or flat.max() >= len(numbers):
        raise InputError("its facets name corners that do not exist: it is damaged")
    cut, polygon = triangles(counts, numbers[flat])
    faces = flat[cut]
    if coloured:
        shares = _shares([row[at : at + 3] for row in vertices])
        return ObjectFile(
            [ObjectPart(numbers, faces, normals, shares[faces], source="vertex colours")]
        )
    own = [row[1 + k :] for row, k in zip(polygons, counts, strict=True)]
    colours, notes = _face_colours(own, polygon)
    source = "face colours" if colours is not None else ""
    return ObjectFile([ObjectPart(numbers, faces, normals, colours, source=source)], notes)


def _shares(rows: list[list[str]]) -> Floats:
    """Colours (n, 3): real numbers to 1, or whole ones to 255 if no number has a point."""
    if any(len(row) < 3 for row in rows):
        raise InputError("some of its colours have fewer than three numbers")
    real = any("." in number for row in rows for number in row)
    values: NDArray[np.generic] = np.array(rows, dtype=np.float64)
    return shown_shares(values if real else values.astype(np.int64))


def _face_colours(rows: list[list[str]], polygon: Ints) -> tuple[Floats | None, list[str]]:
    widths = {len(row) for row in rows}
    if widths == {0}:
        return None, []
    if not widths <= {3, 4}:
        return None, ["colours of some of its faces only, or by a colour map, are left out"]
    notes = []
    if widths == {4} and any(float(row[3]) not in (1.0, 255.0) for row in rows):
        notes.append("its transparency is left out")
    shares = _shares([row[:3] for row in rows])
    return np.repeat(shares[polygon][:, None], 3, axis=1), notes
