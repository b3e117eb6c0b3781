"""3MF files: a closed grammar of what tbcad writes, compared with the STL triangle by triangle.

A slicer obeys elements that leave the mesh as it is: transforms, components, types of objects, beam
lattices, further parts. None of them has a use here, so each is refused by name.
"""

from __future__ import annotations

import ctypes
import io
import tempfile
import zipfile
import zlib
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.record.files import AGAIN, MAX_BYTES, FileBytes, read
from tbcad_verify.record.validation import shown
from tbcad_verify.report.checks import Check, CheckName, at_most

ROUNDED_MM = 1e-6  # the text has six decimals
LARGEST_RATIO = 200.0  # of unpacked to packed bytes; meshes as text reach 10
MODEL = "3D/3dmodel.model"
MEMBERS = (MODEL, "[Content_Types].xml", "_rels/.rels")
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
UUID = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}UUID"
LANGUAGE = "{http://www.w3.org/XML/1998/namespace}lang"
IDENTITY = "1 0 0 0 1 0 0 0 1 0 0 0"
PLACE = "must hold one mesh in millimetres, to be built once where it stands"
# Children and attributes of every element outside the lists of vertices and triangles.
CHILDREN: dict[str, tuple[str, ...]] = {
    "model": ("resources", "build"),
    "resources": ("object",),
    "object": ("mesh",),
    "mesh": ("vertices", "triangles"),
    "vertices": (),
    "triangles": (),
    "build": ("item",),
    "item": (),
}
# None: any value.
ATTRIBUTES: dict[str, dict[str, str | None]] = {
    "model": {"unit": "millimeter", LANGUAGE: None},
    "object": {"id": "1", "name": None, "type": "model", UUID: None},
    "build": {UUID: None},
    "item": {"objectid": "1", "transform": IDENTITY, UUID: None},
}
REQUIRED = {"model": ("unit",), "object": ("id",), "item": ("objectid",)}
COMMENTS = "comments, entities and instructions are not allowed"
LISTS = {
    "vertices": (b"vertex", (b"x", b"y", b"z")),
    "triangles": (b"triangle", (b"v1", b"v2", b"v3")),
}


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


def check_structure(blob: FileBytes) -> None:
    """Refuse a 3MF that is anything but one mesh, in millimetres, built once where it stands.

    Raises:
        BadExport: no zip, members that lie about their size or unpack to too much, other members,
            or an element or attribute that tbcad does not write.

    Source: 3MF Core Specification 1.3, chapters 3 and 4.
    """
    model = _model_text(blob)
    try:
        skeleton = _without_lists(model)
        root = ElementTree.fromstring(skeleton)
        _check_element(root, "model")
    except ElementTree.ParseError as error:
        raise BadExport(f"{blob.name}: broken 3MF ({error}); {AGAIN}") from error
    except ValueError as error:
        raise BadExport(f"{blob.name}: {PLACE}: {error}; {AGAIN}") from error


def _model_text(blob: FileBytes) -> bytes:
    """The members' sizes first; then each member's own head and check sum against the directory."""
    try:
        with zipfile.ZipFile(io.BytesIO(blob.data.tobytes())) as archive:
            members = archive.infolist()
            unpacked = sum(member.file_size for member in members)
            if unpacked > min(MAX_BYTES, LARGEST_RATIO * blob.data.size):
                claim = f"{blob.data.size} bytes that claim to unpack to {unpacked}"
                raise BadExport(f"{blob.name}: {claim}; {AGAIN}")
            names = sorted(member.filename for member in members)
            if names != sorted(MEMBERS):
                given = shown(", ".join(names))
                allowed = ", ".join(MEMBERS)
                raise BadExport(
                    f"{blob.name}: broken 3MF (members are {given}, allowed are {allowed}, each "
                    f"once); {AGAIN}"
                )
            return {name: _member(blob.name, archive, name) for name in MEMBERS}[MODEL]
    except (zipfile.BadZipFile, zlib.error, OSError, ValueError, NotImplementedError) as error:
        raise BadExport(f"{blob.name}: no 3MF, which is a zip ({error}); {AGAIN}") from error


def _member(file: str, archive: zipfile.ZipFile, name: str) -> bytes:
    try:
        return archive.read(name)
    except zipfile.BadZipFile as error:
        if "CRC" not in str(error):
            raise
        raise BadExport(f"{file}: the zip's member {name} is damaged; {AGAIN}") from error


def _without_lists(model: bytes) -> bytes:
    """The model's text without vertices and triangles, which are nothing else than those.

    ValueError: there is more in the text, or less.
    """
    spans = {name: _list_span(model, name) for name in LISTS}
    starts, ends = zip(*sorted(spans.values()), strict=True)
    rest = b"".join(model[i:j] for i, j in zip((0, *ends), (*starts, None), strict=True))
    if b"<!" in rest or rest.count(b"<?") > 1:
        raise ValueError(COMMENTS)
    for name, (item, attributes) in LISTS.items():
        items = model[slice(*spans[name])]
        if not are_counted(items, item, attributes):
            if b"<!" in items or b"<?" in items:
                raise ValueError(COMMENTS)
            keys = ", ".join(key.decode() for key in attributes)
            raise ValueError(f"a list of {name} has {item.decode()} with {keys} only")
    return rest


def are_counted(items: bytes, item: bytes, attributes: tuple[bytes, ...]) -> bool:
    """Whether a text has as many of all parts as of items, and nothing else in angle brackets."""
    parts = (b"<", b"/>", b">", *(b' %s="' % key for key in attributes))
    count = items.count(b"<%s " % item)
    same = {items.count(part) for part in parts} == {count}
    return same and items.count(b"=") == len(attributes) * count


def _list_span(model: bytes, name: str) -> tuple[int, int]:
    """Where a list's items begin and end in the model's text.

    ValueError: there is no such list, or a second one.
    """
    opened, closed = b"<%s>" % name.encode(), b"</%s>" % name.encode()
    start = model.find(opened) + len(opened)
    end = model.find(closed, start)
    if start < len(opened) or end < 0 or model.find(opened, end) >= 0:
        raise ValueError(f"one list of {name} is allowed, without attributes")
    return start, end


def _check_element(element: ElementTree.Element, name: str) -> None:
    """Refuse an element whose name, attributes or children are others than tbcad writes.

    ValueError: what is not allowed.
    """
    if element.tag != CORE + name:
        raise ValueError(f"{_plain(element.tag)} is not allowed, {name} is")
    allowed = ATTRIBUTES.get(name, {})
    for key, value in element.attrib.items():
        if key not in allowed or allowed[key] not in (None, value):
            raise ValueError(f'{name} with {_plain(key)}="{shown(value)}" is not allowed')
    for key in REQUIRED.get(name, ()):
        if key not in element.attrib:
            raise ValueError(f"{name} without {key}")
    text = [element.text, *(child.tail for child in element)]
    if any(part and part.strip() for part in text):
        raise ValueError(f"text in {name} is not allowed")
    children = CHILDREN[name]
    if len(element) != len(children):
        given = ", ".join(_plain(child.tag) for child in element) or "nothing"
        raise ValueError(f"{name} must hold {', '.join(children) or 'nothing'}, not {shown(given)}")
    for child, expected in zip(element, children, strict=True):
        _check_element(child, expected)


def _plain(tag: str) -> str:
    """A name without its namespace."""
    return shown(tag.rpartition("}")[2])
