"""OFF files (Geomview, Object File Format), text, with colours of vertices or faces."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    ObjectFile,
    ObjectPart,
    shown_shares,
    text_of,
    triangles,
    without_facets,
)
from tbcad.types import Floats, Ints

HEADER = re.compile(r"(ST)?(C)?(N)?OFF\b")


def read_off(path: Path) -> ObjectFile:
    """Read a mesh.

    Raises:
        InputError: it is no OFF file of text in three dimensions, or cut off.
    """
    text = text_of(path.read_bytes())
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    lines = [line for line in lines if line]
    match = HEADER.match(lines[0]) if lines else None
    if match is None or "BINARY" in lines[0]:
        raise InputError("its first line is not OFF, COFF, NOFF, STOFF: write it as text")
    rest = lines[0][match.end() :].strip()
    lines = [rest, *lines[1:]] if rest else lines[1:]
    count, facets = (int(number) for number in lines[0].split()[:2])
    rows = [line.split() for line in lines[1 : 1 + count + facets]]
    if len(rows) < count + facets:
        raise InputError("it is cut off: copy it again")
    if facets == 0:
        raise without_facets(count)
    return _contents(rows[:count], rows[count:], bool(match[2]), bool(match[3]))


def _contents(
    vertices: list[list[str]], polygons: list[list[str]], coloured: bool, with_normals: bool
) -> ObjectFile:
    numbers = np.array([row[:3] for row in vertices], dtype=np.float64)
    at = 6 if with_normals else 3
    normals = np.array([row[3:6] for row in vertices], np.float64) if with_normals else None
    counts = np.array([int(row[0]) for row in polygons])
    flat = np.array([int(i) for row, k in zip(polygons, counts, strict=True)
                     for i in row[1 : 1 + k]])  # fmt: skip
    if len(flat) != counts.sum() or flat.min() < 0 or flat.max() >= len(numbers):
        raise InputError("its facets name corners that do not exist: it is damaged")
    cut, polygon = triangles(counts, numbers[flat])
    faces = flat[cut]
    if coloured:
        shares = _shares([row[at : at + 3] for row in vertices])
        return ObjectFile(
            [ObjectPart(numbers, faces, normals, shares[faces], source="vertex colours")]
        )
    own = [row[1 + k :] for row, k in zip(polygons, counts, strict=True)]
    colours, notes = _face_colours(own, polygon)
    source = "face colours" if colours is not None else ""
    return ObjectFile([ObjectPart(numbers, faces, normals, colours, source=source)], notes)


def _shares(rows: list[list[str]]) -> Floats:
    """Colours (n, 3): real numbers to 1, or whole ones to 255 if no number has a point."""
    if any(len(row) < 3 for row in rows):
        raise InputError("some of its colours have fewer than three numbers")
    real = any("." in number for row in rows for number in row)
    values: NDArray[np.generic] = np.array(rows, dtype=np.float64)
    return shown_shares(values if real else values.astype(np.int64))


def _face_colours(rows: list[list[str]], polygon: Ints) -> tuple[Floats | None, list[str]]:
    widths = {len(row) for row in rows}
    if widths == {0}:
        return None, []
    if not widths <= {3, 4}:
        return None, ["colours of some of its faces only, or by a colour map, are left out"]
    notes = []
    if widths == {4} and any(float(row[3]) not in (1.0, 255.0) for row in rows):
        notes.append("its transparency is left out")
    shares = _shares([row[:3] for row in rows])
    return np.repeat(shares[polygon][:, None], 3, axis=1), notes
