"""3MF: vertices and triangles in a zip, millimetres, the same bytes for the same mesh."""

import ctypes
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import lib3mf
import numpy as np

from tbcad.cad.kernel.mesh import Mesh

DECIMALS = 6


def write_3mf(path: Path, name: str, mesh: Mesh) -> None:
    """Write one named object; OSError if the file cannot be written in full.

    The library makes up identifiers, which would differ each time; they are derived from the name.
    """
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
    """Hand the mesh over as it is in memory.

    The library's own method makes an object of each vertex and triangle first.
    """
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
