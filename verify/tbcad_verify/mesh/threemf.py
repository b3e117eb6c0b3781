"""3MF files: read with care, and compared with the STL, triangle by triangle."""

from __future__ import annotations

import ctypes
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.threemf_structure import PLACE, check_structure
from tbcad_verify.record.files import AGAIN, FileBytes, read
from tbcad_verify.report.checks import Check, CheckName, at_most

ROUNDED_MM = 1e-6  # the text has six decimals


def read_3mf(folder: Path, name: str) -> tuple[NDArray[np.float32], FileBytes]:
    """(F, 3, 3) corners of the one mesh of a 3MF, mm, and the bytes they came from.

    Raises:
        BadExport: no zip, members that lie about their size or unpack to too much, or anything
            but one mesh in millimetres.

    Source: 3MF Core Specification 1.3, section 4.
    """
    blob = read(folder, name)
    check_structure(blob)
    with tempfile.TemporaryDirectory(prefix="tbcad-3mf-") as place:
        copy = Path(place) / "part.3mf"  # the library takes bytes one by one, and files at once
        blob.data.tofile(copy)
        return _corners(blob.name, copy), blob


def same_check(name: CheckName, corners: NDArray[np.float32], facets: Facets) -> Check:
    """The 3MF has the STL's facets in the same order, to the last place that float32 has there."""
    expected = facets.corners
    limit = float(np.spacing(np.abs(expected).max())) + ROUNDED_MM
    if corners.shape != expected.shape:
        return at_most(name, np.inf, limit, f"{len(corners)} facets, the STL has {len(expected)}")
    difference = np.abs(corners - expected).max(axis=(1, 2))
    worst = int(difference.argmax())
    return at_most(name, float(difference[worst]), limit, f"facet {worst} is elsewhere in the STL")


@cache
def _library() -> Any:
    """The library with its table of functions, which takes long to fill."""
    import lib3mf

    return lib3mf.get_wrapper()


def _corners(name: str, path: Path) -> NDArray[np.float32]:
    import lib3mf

    model = _library().CreateModel()
    try:
        model.QueryReader("3mf").ReadFromFile(str(path))
        objects, items = model.GetObjects(), model.GetBuildItems()
        good = objects.Count() == items.Count() == 1
    except lib3mf.ELib3MFException as error:
        raise BadExport(f"{name}: broken 3MF ({error}); {AGAIN}") from error
    if not good:
        raise BadExport(f"{name}: {PLACE}; {AGAIN}")
    meshes = model.GetMeshObjects()
    meshes.MoveNext()
    part = meshes.GetCurrentMeshObject()
    if not part.GetVertexCount() or not part.GetTriangleCount():
        raise BadExport(f"{name}: a mesh without triangles; {AGAIN}")
    points = _rows(part, "getvertices", part.GetVertexCount(), np.float32)
    corners = _rows(part, "gettriangleindices", part.GetTriangleCount(), np.uint32)
    return np.asarray(points[corners], np.float32)


def _rows(part: Any, function: str, count: int, kind: type[np.generic]) -> NDArray[Any]:
    """(count, 3) numbers of a mesh, by the library's own function.

    Its Python methods make an object of each row, which takes twenty times as long.
    """
    rows, library = np.empty((count, 3), kind), _library()
    call = getattr(library.lib, f"lib3mf_meshobject_{function}")
    buffer = rows.ctypes.data_as(call.argtypes[-1])
    library.checkError(part, call(part._handle, count, ctypes.c_uint64(), buffer))
    return rows
