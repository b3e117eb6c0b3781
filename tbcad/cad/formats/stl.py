"""Binary STL: triangles as 32-bit floats, millimetres."""

from math import sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.kernel.mesh import Mesh
from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.loop_vectors import cross, dot, minus, scaled, vector
from tbcad.types import Floats, Ints

HEADER = bytes(80)
FACET = np.dtype([("numbers", "<f4", 12), ("attributes", "<u2")])
# A triangle of less area than half of this, mm^2, has no direction.
NO_AREA = 1e-13


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write a mesh; the 80 bytes of the header are zero, so equal meshes give equal bytes.

    Normals are those of the vertices as written: rounding tilts thin triangles, and programs that
    compute the normals again would take others for faults.
    """
    written = np.asarray(mesh.vertices, dtype=np.float32).astype(np.float64)
    facets = np.zeros(len(mesh.triangles), dtype=FACET)
    facets["numbers"] = _facets(written, np.asarray(mesh.triangles, dtype=np.int64))
    with path.open("wb") as file:
        file.write(HEADER + np.uint32(len(facets)).astype("<u4").tobytes())
        file.write(facets.data)


@compiled_loop
def _facets(vertices: Floats, triangles: Ints) -> NDArray[np.float32]:
    """Unit normal and corners of each triangle (t, 3), (t, 12); the normal is 0 without area."""
    result = np.empty((len(triangles), 12), dtype=np.float32)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        first, second, third = vector(vertices[a]), vector(vertices[b]), vector(vertices[c])
        normal = cross(minus(second, first), minus(third, second))
        size = sqrt(dot(normal, normal))
        normal = scaled(1 / size if size > NO_AREA else 0.0, normal)
        for k in range(3):
            result[t, k] = normal[k]
            result[t, 3 + k], result[t, 6 + k], result[t, 9 + k] = first[k], second[k], third[k]
    return result
