"""Numbers and triangles of glTF (ISO/IEC 12113, sections 3.6 and 3.7)."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.simulate.object_files.contents import Part
from tbcad.types import Floats, Ints

if TYPE_CHECKING:
    from tbcad.simulate.object_files.gltf_materials import Materials

DRACO = "KHR_draco_mesh_compression"
TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES, STRIP, FAN = 4, 5, 6
OTHER_MODES = {0: "points", 1: "lines", 2: "lines", 3: "lines"}
Values = NDArray[Any]


class Accessors:
    """Tables of numbers in the buffers of a document."""

    def __init__(self, document: dict[str, Any], buffers: list[bytes]) -> None:
        """Keep both; tables are read when they are asked for."""
        self._document, self._buffers = document, buffers

    def view(self, number: int) -> bytes:
        """The bytes of a buffer view."""
        view = self._document["bufferViews"][number]
        start = view.get("byteOffset", 0)
        data: bytes = self._buffers[view["buffer"]][start : start + view["byteLength"]]
        if len(data) < view["byteLength"]:
            raise InputError("one of its buffers is cut off: copy it again")
        return data

    def numbers(self, number: int) -> Values:
        """A table (n, width) as it is stored."""
        accessor = self._document["accessors"][number]
        count, width = int(accessor["count"]), WIDTHS[accessor["type"]]
        kind = np.dtype("<" + TYPES[accessor["componentType"]])
        if "bufferView" in accessor:
            found = self._table(accessor["bufferView"], accessor.get("byteOffset", 0), kind,
                                count, width)  # fmt: skip
        else:
            found = np.zeros((count, width), dtype=kind)
        if "sparse" in accessor:
            found = self._replaced(found.copy(), accessor["sparse"])
        return found

    def real(self, number: int) -> Floats:
        """A table (n, width); whole numbers that are normalized become 0 to 1, or -1 to 1."""
        found = self.numbers(number)
        accessor = self._document["accessors"][number]
        if accessor.get("normalized") and found.dtype.kind in "iu":
            return np.maximum(found / np.iinfo(found.dtype).max, -1.0)
        return found.astype(np.float64)

    def _table(self, view: int, offset: int, kind: np.dtype[Any], count: int, width: int) -> Values:
        data = self.view(view)
        step = self._document["bufferViews"][view].get("byteStride", 0) or width * kind.itemsize
        if offset + max(count - 1, 0) * step + width * kind.itemsize * (count > 0) > len(data):
            raise InputError("one of its buffers is cut off: copy it again")
        if count == 0:
            return np.zeros((0, width), dtype=kind)
        strides = (step, kind.itemsize)
        return np.ndarray((count, width), kind, data, offset, strides)

    def _replaced(self, values: Values, sparse: dict[str, Any]) -> Values:
        count, where, what = sparse["count"], sparse["indices"], sparse["values"]
        kind = np.dtype("<" + TYPES[where["componentType"]])
        rows = self._table(where["bufferView"], where.get("byteOffset", 0), kind, count, 1)
        values[rows[:, 0]] = self._table(
            what["bufferView"], what.get("byteOffset", 0), values.dtype, count, values.shape[1]
        )
        return values


def primitive_part(
    primitive: dict[str, Any], accessors: Accessors, materials: "Materials", notes: list[str]
) -> Part | None:
    """The triangles of a primitive with their colours; None where it is points or lines."""
    mode = primitive.get("mode", TRIANGLES)
    if mode in OTHER_MODES:
        notes.append(f"its {OTHER_MODES[mode]} are left out")
        return None
    if DRACO in primitive.get("extensions", {}):
        attributes, index = _unpacked(primitive["extensions"][DRACO], accessors)
    else:
        attributes = {name: accessors.real(k) for name, k in primitive["attributes"].items()}
        index = accessors.numbers(primitive["indices"])[:, 0] if "indices" in primitive else None
    points = attributes["POSITION"][:, :3]
    index = np.arange(len(points)) if index is None else index.astype(np.int64)
    faces = _faces(index, mode)
    if len(faces) and faces.max() >= len(points):
        raise InputError("its facets name corners that do not exist: it is damaged")
    part = Part(points, faces, attributes.get("NORMAL"))
    part = materials.coloured(part, primitive.get("material"), attributes)
    return part if part.normals is not None else part.flat()


def _faces(index: Ints, mode: int) -> Ints:
    if mode == TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    if len(index) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if mode == FAN:
        first = np.broadcast_to(index[0], len(index) - 2)
        return np.column_stack([first, index[1:-1], index[2:]])
    faces = np.column_stack([index[:-2], index[1:-1], index[2:]])
    faces[1::2] = faces[1::2, ::-1]
    return faces


def _unpacked(
    extension: dict[str, Any], accessors: Accessors
) -> tuple[dict[str, Floats], Ints | None]:
    """Attributes and corners of a primitive that Draco compressed."""
    try:
        import DracoPy
    except ImportError:
        raise InputError(
            "it is compressed by Draco: pip install DracoPy, or export it without compression"
        ) from None
    mesh = DracoPy.decode(accessors.view(extension["bufferView"]))
    attributes = {}
    for name, identity in extension["attributes"].items():
        values = np.asarray(mesh.get_attribute_by_unique_id(identity)["data"])
        share = 1.0
        if name.startswith("COLOR") and values.dtype.kind == "u":
            share = float(np.iinfo(values.dtype).max)
        attributes[name] = values.reshape(len(mesh.points), -1).astype(np.float64) / share
    return attributes, np.asarray(mesh.faces, dtype=np.int64).ravel()
