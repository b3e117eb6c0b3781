"""The document of a glTF file with its buffers, and numbers in it that are checked."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    AGAIN,
    ROUNDING,
    Fault,
    in_range,
    range_text,
)
from tbcad.types import Bytes, Floats

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
CUT_OFF = "one of its buffers is cut off: copy it again"
Json = dict[str, Any]
Values = NDArray[Any]


@dataclass
class GltfFile:
    """A document with its buffers, the pictures that were asked for, and what is left out of it."""

    path: Path
    document: Json
    buffers: list[bytes]
    notes: list[str] = field(default_factory=list)
    pictures: dict[Any, Bytes | None] = field(default_factory=dict)

    def view(self, number: int) -> bytes:
        """The bytes of a buffer view."""
        view = self.document["bufferViews"][number]
        start = view.get("byteOffset", 0)
        data: bytes = self.buffers[view["buffer"]][start : start + view["byteLength"]]
        if len(data) < view["byteLength"]:
            raise InputError(CUT_OFF)
        return data

    def numbers(self, number: int) -> Values:
        """A table (n, width) as it is stored."""
        accessor = self.document["accessors"][number]
        count, width = int(accessor["count"]), WIDTHS[accessor["type"]]
        kind = np.dtype(TYPES[accessor["componentType"]])
        found = np.zeros((count, width), dtype=kind)
        if "bufferView" in accessor:
            found = self._table(accessor, kind, count, width)
        if "sparse" in accessor:
            sparse, found = accessor["sparse"], found.copy()
            where = np.dtype(TYPES[sparse["indices"]["componentType"]])
            rows = self._table(sparse["indices"], where, sparse["count"], 1)[:, 0]
            found[rows] = self._table(sparse["values"], kind, sparse["count"], width)
        return found

    def real(self, number: int) -> Floats:
        """A table (n, width); whole numbers that are normalized become 0 to 1, or -1 to 1."""
        found = self.numbers(number)
        if self.document["accessors"][number].get("normalized") and found.dtype.kind in "iu":
            return np.maximum(found / np.iinfo(found.dtype).max, -1.0)
        return found.astype(np.float64)

    def material(self, number: int | None) -> Json:
        """A material by its number; of none one that says nothing."""
        if number is not None and not 0 <= number < len(self.document.get("materials", [])):
            raise InputError(f"it names material {number}, which it does not have: {AGAIN}")
        found: Json = {} if number is None else self.document["materials"][number]
        return found

    def factor(
        self, holder: Json, key: str, default: Sequence[float] | float, high: float = 1.0
    ) -> Floats:
        """A factor from 0 on, () or (n,); as it is when nothing is said, and a fault, if bad."""
        said = holder.get(key, default)
        numbers = said if isinstance(said, list | tuple) else [said]
        found = in_range(numbers, [np.size(default)], 0.0, high + ROUNDING)
        if found is None:
            allowed = range_text(0.0, high) + (f", {np.size(default)} times" * (np.ndim(default)))
            self.notes.append(Fault(f"{key} is {said!s:.40}, allowed is {allowed}: {AGAIN}"))
        return np.reshape(default if found is None else found, np.shape(default)).astype(float)

    def _table(self, at: Json, kind: np.dtype[Any], count: int, width: int) -> Values:
        step = self.document["bufferViews"][at["bufferView"]].get("byteStride", 0)
        steps = step or width * kind.itemsize, kind.itemsize
        data, offset = self.view(at["bufferView"]), at.get("byteOffset", 0)
        try:
            return np.ndarray((count, width), kind, data, offset, steps)
        except (TypeError, ValueError):
            raise InputError(CUT_OFF) from None


def finite(transform: Json, key: str, default: Sequence[float] | float) -> Floats:
    """Numbers of a texture's transform, () or (2,); InputError: not so many, or not finite."""
    said = transform.get(key, default)
    numbers = said if isinstance(said, list | tuple) else [said]
    if in_range(numbers, [np.size(default)], -np.inf, np.inf) is None:
        raise InputError(f"{key} of a texture is {said!s:.40}, allowed are finite numbers: {AGAIN}")
    return np.reshape(numbers, np.shape(default)).astype(float)
