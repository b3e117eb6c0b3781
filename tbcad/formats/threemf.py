"""3MF: vertices and triangles in a zip, millimetres, the same bytes for the same mesh."""

import locale
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import lib3mf
import numpy as np

from tbcad.cad.mesh import Mesh
from tbcad.formats.native_files import check_complete, incomplete

DECIMALS = 6
ZIP_END = b"PK\x05\x06"  # begins the last record of a zip


def write_3mf(path: Path, name: str, mesh: Mesh) -> None:
    """Write one named object.

    Raises:
        OSError: when the file cannot be written in full.

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
    try:
        with same_locale():
            writer.WriteToFile(str(path))
    except lib3mf.ELib3MFException as error:
        raise incomplete(path) from error
    check_complete(path, ZIP_END)


@contextmanager
def same_locale() -> Iterator[None]:
    """The library leaves the process in the locale C, in which Python opens texts as ASCII."""
    before = locale.setlocale(locale.LC_ALL)
    try:
        yield
    finally:
        locale.setlocale(locale.LC_ALL, before)


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
