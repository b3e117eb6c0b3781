"""3MF files: a closed grammar of what tbcad writes, compared with the STL triangle by triangle.

A slicer obeys elements that leave the mesh as it is: transforms, components, types of objects, beam
lattices, further parts. None of them has a use here. So every tag has the one form that it has in
a build, in its order; between them is nothing, and in both lists of the mesh are figures alone.
"""

from __future__ import annotations

import io
import re
import warnings
import zipfile
import zlib
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.record.files import AGAIN, MAX_BYTES, FileBytes, read
from tbcad_verify.record.validation import shown
from tbcad_verify.report.checks import Check, CheckName, at_most

ROUNDED_MM = 1e-6  # the text has six decimals
LARGEST_RATIO = 200.0  # of unpacked to packed bytes; meshes as text reach 10
MODEL, TYPES, RELATIONS = "3D/3dmodel.model", "[Content_Types].xml", "_rels/.rels"
PLACE = "must hold one mesh in millimetres, to be built once where it stands"
XML = r'<\?xml version="1\.0" encoding="utf-8"\?>'
SCHEMAS = "http://schemas.microsoft.com/3dmanufacturing"
UUID = r' p:UUID="[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"'
# Names of extensions that the library knows; without `requiredextensions` they ask for nothing.
EXTENSIONS = r'(?: xmlns:[a-z]{1,2}="http://schemas\.[\w./]+")*'
MILLIMETRES = 'unit="millimeter" xml:lang="en-US"'
PACKAGE = r"http://schemas\.openxmlformats\.org/package/2006/[\w-]+"
FORMS = {
    MODEL: (
        *(XML, rf'<model xmlns="{SCHEMAS}/core/2015/02" {MILLIMETRES}{EXTENSIONS}>'),
        *("<resources>", rf'<object id="1" name="NAME" type="model"{UUID}>', "<mesh>"),
        *("<vertices>", "</vertices>", "<triangles>", "</triangles>", "</mesh>", "</object>"),
        *("</resources>", f"<build{UUID}>", f'<item objectid="1"{UUID} ?/>'),
        *("</build>", "</model>"),
    ),
    TYPES: (
        *(XML, f'<Types xmlns="{PACKAGE}">'),
        *6 * (r'<Default Extension="[a-z]+" ContentType="[\w./+-]+" ?/>',),
        "</Types>",
    ),
    RELATIONS: (
        *(XML, f'<Relationships xmlns="{PACKAGE}">'),
        rf'<Relationship Type="{SCHEMAS}/2013/01/3dmodel" Target="/{MODEL}" Id="rel0" ?/>',
        "</Relationships>",
    ),
}
LISTS = {
    "vertices": (b'<vertex x="', b'" y="', b'" z="'),
    "triangles": (b'<triangle v1="', b'" v2="', b'" v3="'),
}
ENDS = b'" />', b'"/>'
BLANKS, DIGITS = b" \t\r\n", b"0123456789"


def read_3mf(folder: Path, name: str) -> tuple[NDArray[np.float32], FileBytes]:
    """(F, 3, 3) corners of the one mesh of a 3MF, mm, and the bytes they came from.

    BadExport: no zip, members that lie about their size or unpack to too much, or anything but one
    mesh in millimetres that has the file's name.

    Source: 3MF Core Specification 1.3, chapters 3 and 4.
    """
    blob = read(folder, name)
    texts = _members(blob)
    try:
        lists = {key: _list_span(texts[MODEL], key) for key in LISTS}
        for key, text in texts.items():
            spans = sorted(lists.values()) if key == MODEL else []
            _refuse_other_tags(_without(text, spans), FORMS[key], Path(name).stem)
        points, corners = (
            _figures(texts[MODEL][slice(*lists[key])], key, kind)
            for key, kind in (("vertices", np.float64), ("triangles", np.int64))
        )
        if not corners.size or corners.max() >= len(points):
            raise ValueError("a triangle without vertices, or none")
    except ValueError as error:
        raise BadExport(f"{blob.name}: {PLACE}: {error}; {AGAIN}") from error
    return points.astype(np.float32)[corners], blob


def same_check(name: CheckName, corners: NDArray[np.float32], facets: Facets) -> Check:
    """The 3MF has the STL's facets in the same order, to the last place that float32 has there."""
    expected = facets.corners
    limit = float(np.spacing(np.abs(expected).max())) + ROUNDED_MM
    if corners.shape != expected.shape:
        return at_most(name, np.inf, limit, f"{len(corners)} facets, the STL has {len(expected)}")
    difference = np.abs(corners - expected).max(axis=(1, 2))
    worst = int(difference.argmax())
    return at_most(name, float(difference[worst]), limit, f"facet {worst} is elsewhere in the STL")


def _members(blob: FileBytes) -> dict[str, bytes]:
    """The members' sizes first; then each member's own head and check sum against the directory."""
    try:
        with zipfile.ZipFile(io.BytesIO(blob.data.tobytes())) as archive:
            members = archive.infolist()
            unpacked = sum(member.file_size for member in members)
            if unpacked > min(MAX_BYTES, LARGEST_RATIO * blob.data.size):
                claim = f"{blob.data.size} bytes that claim to unpack to {unpacked}"
                raise BadExport(f"{blob.name}: {claim}; {AGAIN}")
            names = sorted(member.filename for member in members)
            if names != sorted(FORMS):
                given, allowed = shown(", ".join(names)), ", ".join(FORMS)
                raise BadExport(
                    f"{blob.name}: broken 3MF (members are {given}, allowed are {allowed}, each "
                    f"once); {AGAIN}"
                )
            return {name: archive.read(name) for name in FORMS}
    except (zipfile.BadZipFile, zlib.error, OSError, ValueError, NotImplementedError) as error:
        raise BadExport(f"{blob.name}: no 3MF, which is a whole zip ({error}); {AGAIN}") from error


def _list_span(model: bytes, name: str) -> tuple[int, int]:
    """Where a list's items begin and end in the model's text.

    ValueError: there is no such list.
    """
    opened, closed = b"<%s>" % name.encode(), b"</%s>" % name.encode()
    start = model.find(opened) + len(opened)
    end = model.find(closed, start)
    if start < len(opened) or end < 0:
        raise ValueError(f"one list of {name} is allowed, without attributes")
    return start, end


def _without(text: bytes, spans: list[tuple[int, int]]) -> str:
    """A text without some of its pieces. ValueError: what is left has other signs than ASCII."""
    starts, ends = [start for start, _ in spans], [end for _, end in spans]
    pieces = (text[i:j] for i, j in zip([0, *ends], [*starts, None], strict=True))
    return b"".join(pieces).decode("ascii")


def _refuse_other_tags(text: str, forms: tuple[str, ...], name: str) -> None:
    """Refuse a text that is no list of tags, each of its form. ValueError: the first other one."""
    tags = re.sub(r">\s+<", "><", text.strip()).replace("><", ">\n<").split("\n")
    for tag, form in zip_longest(tags, forms, fillvalue=""):
        allowed = form.replace("NAME", re.escape(name))
        if not re.fullmatch(allowed, tag):
            raise ValueError(f"{shown(tag) or 'its end'} is not allowed, {allowed or 'its end'} is")


def _figures(items: bytes, name: str, kind: type[np.generic]) -> NDArray[Any]:
    """(N, 3) figures of the items of a list; only floats have signs and points.

    ValueError: something else is in it, or a figure has other signs.
    """
    marks, count = LISTS[name], items.count(b"<")
    for mark in marks:
        if items.count(mark) != count:
            raise ValueError(f"a list of {name} has {marks[0][1:].decode()}...{marks[2].decode()}")
        items = items.replace(mark, b" ")
    for end in ENDS:
        items = items.replace(end, b" ")
    if other := items.translate(None, DIGITS + BLANKS + b"-." * (kind is np.float64)):
        raise ValueError(f"{shown(other.decode('ascii', 'replace'))} in a list of {name}")
    with warnings.catch_warnings(action="ignore"):  # it ends at what is no figure
        figures = np.fromstring(items, kind, sep=" ")
    if figures.size != 3 * count:
        raise ValueError(f"a figure is missing or none in a list of {name}")
    return figures.reshape(-1, 3)
