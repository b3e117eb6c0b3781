"""PLY files of coloured points and meshes (G. Turk, The PLY Polygon File Format, 1994), binary."""

import numpy as np

from tbcad.types import Bytes, Floats, Ints

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


FACET = np.dtype([("corners", "u1"), ("vertex", "<i4", 3)])


def mesh_ply(points: Floats, normals: Floats, faces: Ints, colours: Floats | None = None) -> bytes:
    """The file of triangles (f, 3) over points, unit normals, colours from 0 to 1, (v, 3) each."""
    given = [points, normals] if colours is None else [points, normals, colours]
    names = [*"xyz", "nx", "ny", "nz", "red", "green", "blue"][: 3 * len(given)]
    lines = (
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(points)}",
        *(f"property float {name}" for name in names),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    )
    facets = np.zeros(len(faces), dtype=FACET)
    facets["corners"], facets["vertex"] = 3, faces
    vertices = np.concatenate(given, axis=1).astype("<f4")
    return ("\n".join(lines) + "\n").encode() + vertices.tobytes() + facets.tobytes()
