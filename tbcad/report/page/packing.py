"""Arrays as text in a page: little-endian, one after the other, deflated, base64."""

import base64
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

LEVEL = 6
ALIGNED = 4  # bytes: typed arrays of a browser begin at multiples of their items
# Kinds of numbers by the names of JavaScript's typed arrays.
KINDS = {"Int16Array": "<i2", "Uint16Array": "<u2", "Uint32Array": "<u4", "Float32Array": "<f4"}

Place = list[int | str]
"""Where an array lies: first byte, number of items, kind."""


@dataclass
class PackedArrays:
    """Arrays that are added one by one, and the text that holds them all."""

    _parts: list[bytes] = field(default_factory=list)
    _size: int = 0

    def add(self, values: NDArray[Any], kind: str) -> Place:
        """Add an array, flattened, as one of KINDS; return where it lies."""
        data = np.ascontiguousarray(values, dtype=KINDS[kind]).tobytes()
        place: Place = [self._size, values.size, kind]
        padded = data + bytes(-len(data) % ALIGNED)
        self._parts.append(padded)
        self._size += len(padded)
        return place

    def text(self) -> str:
        """All arrays: zlib's format, in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts), LEVEL)).decode("ascii")
