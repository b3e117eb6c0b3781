"""PLY files of coloured points (G. Turk, The PLY Polygon File Format, 1994), binary."""

import numpy as np

from tbcad.types import Bytes, Floats

VERTEX = np.dtype([("place", "<f4", 3), ("colour", "u1", 3)])
PROPERTIES = (
    *(f"property float {name}" for name in "xyz"),
    *(f"property uchar {name}" for name in ("red", "green", "blue")),
)


def points_ply(points: Floats, colours: Bytes) -> bytes:
    """The file of points (n, 3) with red, green and blue (n, 3)."""
    lines = (
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(points)}",
        *PROPERTIES,
        "end_header",
    )
    vertices = np.zeros(len(points), dtype=VERTEX)
    vertices["place"], vertices["colour"] = points, colours
    return ("\n".join(lines) + "\n").encode() + vertices.tobytes()
