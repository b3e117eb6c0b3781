"""Meshes as files, the same bytes for the same mesh: binary STL, 3MF (both mm), and PLY.

PLY: G. Turk, The PLY Polygon File Format, 1994.
"""

import ctypes
from collections.abc import Sequence
from math import sqrt
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.kernel.mesh import Mesh
from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.loop_vectors import cross, dot, minus, scaled, vector
from tbcad.types import Bytes, Floats, Ints

HEADER = bytes(80)
FACET = np.dtype([("numbers", "<f4", 12), ("attributes", "<u2")])
NO_AREA = 1e-13  # a triangle of less area than half of this, mm^2, has no direction
DECIMALS = 6
PLY_VERTEX = np.dtype([("place", "<f4", 3), ("colour", "u1", 3)])
PLY_PROPERTIES = (
    *(f"property float {name}" for name in "xyz"),
    *(f"property uchar {name}" for name in ("red", "green", "blue")),
)
PLY_FACET = np.dtype([("corners", "u1"), ("vertex", "<i4", 3)])


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


def write_3mf(path: Path, name: str, mesh: Mesh) -> None:
    """Write one named object; OSError if the file cannot be written in full.

    The library makes up identifiers, which would differ each time; they are derived from the name.
    """
    import lib3mf

    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    part = model.AddMeshObject()
    part.SetName(name)
    _set_geometry(wrapper, part, mesh)
    item = model.AddBuildItem(part, wrapper.GetIdentityTransform())
    part.SetUUID(_identifier(name, "part"))
    item.SetUUID(_identifier(name, "item"))
    model.SetBuildUUID(_identifier(name, "build"))
    writer = model.QueryWriter("3mf")
    writer.SetDecimalPrecision(DECIMALS)
    path.write_bytes(_written(wrapper, writer))


def _written(wrapper: Any, writer: Any) -> bytes:
    """The bytes of the file.

    Writing files itself the library would leave the process in the locale C, and its own method for
    bytes makes an object of each. The first call writes, and tells their number.
    """
    call, size = wrapper.lib.lib3mf_writer_writetobuffer, ctypes.c_uint64(0)
    wrapper.checkError(writer, call(writer._handle, ctypes.c_uint64(0), size, None))
    buffer = (ctypes.c_uint8 * size.value)()
    wrapper.checkError(writer, call(writer._handle, size, size, buffer))
    return bytes(buffer)


def _set_geometry(wrapper: Any, part: Any, mesh: Mesh) -> None:
    """Hand the mesh over as it is: the library's own method makes an object of each facet first."""
    vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float32)
    triangles = np.ascontiguousarray(mesh.triangles, dtype=np.uint32)
    call = wrapper.lib.lib3mf_meshobject_setgeometry
    _, _, points, _, corners = call.argtypes
    code = call(
        part._handle,
        len(vertices),
        vertices.ctypes.data_as(points),
        len(triangles),
        triangles.ctypes.data_as(corners),
    )
    wrapper.checkError(part, code)


def _identifier(name: str, what: str) -> str:
    return str(uuid5(NAMESPACE_URL, f"tbcad:{name}:{what}"))


def points_ply(points: Floats, colours: Bytes) -> bytes:
    """The file of points (n, 3) with red, green and blue (n, 3)."""
    vertices = np.zeros(len(points), dtype=PLY_VERTEX)
    vertices["place"], vertices["colour"] = points, colours
    return _ply(len(points), PLY_PROPERTIES) + vertices.tobytes()


def mesh_ply(points: Floats, normals: Floats, faces: Ints, colours: Floats | None = None) -> bytes:
    """The file of triangles (f, 3) over points, unit normals, colours from 0 to 1, (v, 3) each."""
    given = [points, normals] if colours is None else [points, normals, colours]
    names = [*"xyz", "nx", "ny", "nz", "red", "green", "blue"][: 3 * len(given)]
    facets = np.zeros(len(faces), dtype=PLY_FACET)
    facets["corners"], facets["vertex"] = 3, faces
    vertices = np.concatenate(given, axis=1).astype("<f4")
    of_faces = f"element face {len(faces)}", "property list uchar int vertex_indices"
    head = _ply(len(points), (*(f"property float {name}" for name in names), *of_faces))
    return head + vertices.tobytes() + facets.tobytes()


def _ply(vertices: int, lines: Sequence[str]) -> bytes:
    """The head of a file of vertices with some properties, and of what comes after."""
    head = "ply", "format binary_little_endian 1.0", f"element vertex {vertices}"
    return ("\n".join([*head, *lines, "end_header"]) + "\n").encode()
