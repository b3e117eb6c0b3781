"""An object's file of any format that is read, STL and 3MF here; others are refused with advice."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    AGAIN,
    Fault,
    ObjectFile,
    ObjectPart,
    without_facets,
)
from tbcad.light.simulate.object_files.gltf import read_gltf
from tbcad.light.simulate.object_files.ply import read_off, read_ply
from tbcad.light.simulate.object_files.wavefront import read_obj
from tbcad.types import Floats

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
UNITS = ("um", "mm", "cm", "in", "ft", "m")  # in the order of lib3mf's ModelUnit
MOST_DEEP = 32
GREY = 0.8  # of facets without a colour beside some that have one
OWN_COLOUR = 0x8000  # bit of VisCAM; Materialise sets it where the whole part's colour holds


def read_object_file(path: Path) -> ObjectFile:
    """Read an object's file as it is.

    InputError: it is not there, in no format that is read, damaged, or without facets.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a triangle mesh ({FORMATS})")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise InputError(f"{path} is over 1 GiB: reduce the mesh first")
    read = READERS[_format(path)]
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


def _format(path: Path) -> str:
    """The end of a file's name; InputError: its format is not read, or it is packed."""
    kind = path.suffix.lower()
    if kind in _WHY_NOT:
        raise InputError(f"{path} {_WHY_NOT[kind]}")
    with path.open("rb") as file:
        head = file.read(4)
    if head[:2] == _GZIP or (head == _ZIP and kind != ".3mf"):
        raise InputError(f"{path} {_PACKED}")
    if kind not in READERS:
        raise InputError(f"{path} cannot be read as a mesh: give {FORMATS}")
    return kind


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


def read_3mf(path: Path) -> ObjectFile:
    """Read all meshes that the file builds, where it puts them.

    InputError: lib3mf cannot read it, or it builds no mesh.
    """
    import lib3mf

    model = lib3mf.get_wrapper().CreateModel()
    try:
        reader = model.QueryReader("3mf")
        reader.SetStrictModeActive(False)
        reader.ReadFromFile(str(path))
    except lib3mf.ELib3MFException as error:
        raise InputError(f"lib3mf says: {error}") from None
    notes, parts, items = list[str](), list[ObjectPart](), model.GetBuildItems()
    while items.MoveNext():
        item = items.GetCurrent()
        matrix = _3mf_matrix(item.GetObjectTransform())
        parts += _3mf_parts(model, item.GetObjectResource(), matrix, notes)
    if not parts:
        raise InputError("it builds no mesh: its build section is empty")
    return ObjectFile(parts, list(dict.fromkeys(notes)), UNITS[int(model.GetUnit())], "z")


def _3mf_matrix(transform: Any) -> Floats:
    """A matrix (4, 4) of 3MF's rows, which multiply points from the right."""
    rows = np.array([list(row) for row in transform.Fields], dtype=np.float64)
    return np.vstack([rows.T, [0, 0, 0, 1]])


def _3mf_parts(
    model: Any, found: Any, matrix: Floats, notes: list[str], deep: int = 0
) -> list[ObjectPart]:
    """Meshes of an object, or of its components."""
    if deep > MOST_DEEP:
        raise InputError("its components hold each other")
    if found.IsMeshObject():
        part = _3mf_part(model, model.GetMeshObjectByID(found.GetUniqueResourceID()), notes)
        return [part.moved(matrix)] if len(part.faces) else []
    if not found.IsComponentsObject():
        return []
    whole, parts = model.GetComponentsObjectByID(found.GetUniqueResourceID()), list[ObjectPart]()
    for k in range(whole.GetComponentCount()):
        one = whole.GetComponent(k)
        own = matrix @ _3mf_matrix(one.GetTransform()) if one.HasTransform() else matrix
        parts += _3mf_parts(model, one.GetObjectResource(), own, notes, deep + 1)
    return parts


def _3mf_part(model: Any, mesh: Any, notes: list[str]) -> ObjectPart:
    """A mesh with the colours of its triangles, or that of the whole."""
    points = np.array([list(one.Coordinates) for one in mesh.GetVertices()], dtype=np.float64)
    faces = np.array([list(one.Indices) for one in mesh.GetTriangleIndices()], dtype=np.int64)
    part = ObjectPart(points.reshape(-1, 3), faces.reshape(-1, 3))
    keys = [(one.ResourceID, tuple(one.PropertyIDs)) for one in mesh.GetAllTriangleProperties()]
    resource, number, whole = mesh.GetObjectLevelProperty()
    fallback = _3mf_colour(model, resource, number, notes) if whole else None
    known = {(r, p): _3mf_colour(model, r, p, notes) for r, three in set(keys) if r for p in three}
    if fallback is None and not any(colour is not None for colour in known.values()):
        return part
    other = fallback or (GREY,) * 3
    rows = [[known.get((r, p)) or other for p in three] for r, three in keys]
    colours = np.array(rows or [[other] * 3] * len(faces), dtype=np.float64)
    return replace(part, colours=colours, source="colours of triangles")


def _3mf_colour(
    model: Any, resource: int, number: int, notes: list[str]
) -> tuple[float, float, float] | None:
    import lib3mf

    kind = model.GetPropertyTypeByID(resource)
    if kind == lib3mf.PropertyType.BaseMaterial:
        colour = model.GetBaseMaterialGroupByID(resource).GetDisplayColor(number)
    elif kind == lib3mf.PropertyType.Colors:
        colour = model.GetColorGroupByID(resource).GetColor(number)
    else:
        notes.append("its textures and mixed materials are left out")
        return None
    if not any((colour.Red, colour.Green, colour.Blue, colour.Alpha)):  # lib3mf's of a bad one
        notes.append(Fault(f"one of its colours is not #RRGGBB, or has no opacity at all: {AGAIN}"))
    elif colour.Alpha < 255:
        notes.append("its transparency is left out")
    return colour.Red / 255, colour.Green / 255, colour.Blue / 255


READERS = {
    ".ply": read_ply, ".stl": read_stl, ".obj": read_obj, ".off": read_off, ".coff": read_off,
    ".glb": read_gltf, ".gltf": read_gltf, ".3mf": read_3mf,
}  # fmt: skip
