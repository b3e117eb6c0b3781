"""The contents of an object's file, whatever its format."""

from base64 import b64decode
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PureWindowsPath
from typing import Any, Literal, NamedTuple
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.pictures import picture_of
from tbcad.cad.formats.pixels import Picture
from tbcad.common.figure_files import srgb
from tbcad.core.geometry.vectors import facet_vectors
from tbcad.errors import InputError
from tbcad.light.simulate.object_files.finish import Finish
from tbcad.types import Bytes, Floats, Ints

Up = Literal["y", "z"]
# Real colours of at least so much in one file are bytes; those over 1 and below are refused.
LEAST_OF_BYTES, ROUNDING = 2.0, 1e-3
UNITS_MM = {"um": 0.001, "mm": 1.0, "cm": 10.0, "in": 25.4, "ft": 304.8, "m": 1000.0}
MAX_PICTURE_BYTES = 1 << 30
AGAIN, BESIDE = "export it again", "put it there, or do not name it"


@dataclass(frozen=True)
class ObjectPart:
    """Triangles with colours of one kind."""

    points: Floats  # corners, in the unit and the axes of the file, (v, 3)
    faces: Ints  # corners of the facets, (f, 3)
    # at the corners, as the file has them, (v, 3); None where it has none
    normals: Floats | None = None
    # at each facet's corners, 0 to 1 as shown (sRGB), (f, 3, 3); None: it has none
    colours: Floats | None = None
    # where each facet's corners lie on `picture`, 0 to 1 from its lower left, (f, 3, 2)
    uv: Floats | None = None
    picture: Bytes | None = None  # (h, w, 3)
    finish: Finish | None = None  # of its facets, by its material; None: it is matt
    source: str = ""  # what the colours are, for the user; "" where there are none

    def moved(self, matrix: Floats) -> "ObjectPart":
        """The part moved by a matrix (4, 4); normals follow its inverse."""
        points = self.points @ matrix[:3, :3].T + matrix[:3, 3]
        if self.normals is None:
            return replace(self, points=points)
        cofactors = np.stack([np.cross(matrix[(k + 1) % 3, :3], matrix[(k + 2) % 3, :3])
                              for k in range(3)])  # fmt: skip
        return replace(self, points=points, normals=self.normals @ cofactors.T)

    def flat(self) -> "ObjectPart":
        """The part with corners of their own for each facet, which is then shaded flat."""
        faces = np.arange(self.faces.size).reshape(-1, 3)
        return replace(self, points=self.points[self.faces].reshape(-1, 3), faces=faces)


class Fault(str):
    """A note of what cannot be converted: the file is refused where its colours are asked for."""

    __slots__ = ()


class ObjectFile(NamedTuple):
    """A file as it is read."""

    parts: Sequence[ObjectPart]  # its triangles
    notes: Sequence[str] = ()  # what is left out of it; what is a `Fault` may not be
    unit: str | None = None  # key of UNITS_MM; None where the file does not say
    up: Up | None = None  # the axis that points up; None where the file does not say


def shown_shares(values: NDArray[Any]) -> Floats:
    """Colours from 0 to 1 of numbers of a type: whole ones of 8, 16 or 32 bits, or real ones.

    Whole numbers of other types are taken for bytes, and real ones if the largest is at least 2.

    InputError: they are out of range.
    """
    largest = {"u1": 255, "u2": 65535}.get(values.dtype.str[-2:])
    if largest is None:
        bytes_as_reals = values.size and values.max() >= LEAST_OF_BYTES
        largest = 255 if values.dtype.kind in "iu" or bytes_as_reals else 1
    share = values.astype(np.float64) / largest
    if not ((share >= 0) & (share <= 1 + ROUNDING)).all():
        raise InputError(
            "its colours are out of range: allowed is 0 to 1, 0 to 255, or 0 to 65535 as ushort"
        )
    return share.clip(0, 1)


def in_range(
    numbers: Sequence[Any], counts: Sequence[int], low: float, high: float
) -> list[float] | None:
    """Numbers of a material as real ones; None: not so many, one is none, or out of a range."""
    good = len(numbers) in counts and all(type(one) in (int, float) for one in numbers)
    good = good and all(low <= one <= high and np.isfinite(one) for one in numbers)
    return [*map(float, numbers)] if good else None


def range_text(low: float, high: float) -> str:
    """What `in_range` allows, for the user."""
    return f"a number from {low:g} to {high:g}" if high < np.inf else f"a number of {low:g} or more"


def text_of(data: bytes) -> str:
    """A text file of UTF-8, or of UTF-16 with its mark; what is neither becomes a question mark."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    return data.decode("utf-8-sig", "replace")


def even(colour: Sequence[float] | Floats, facets: int) -> Floats:
    """One colour (3,) at all corners of facets, (f, 3, 3)."""
    return np.broadcast_to(np.asarray(colour, dtype=np.float64), (facets, 3, 3)).copy()


def without_facets(points: int) -> InputError:
    """The error of a file that has nothing to see."""
    if points == 0:
        return InputError("it is empty: name a mesh with facets")
    return InputError(
        f"it has {points} points and no facets: name a triangle mesh; MeshLab makes one of a cloud "
        "of points (screened Poisson)"
    )


def triangles(counts: Ints, points: Floats) -> tuple[Ints, Ints]:
    """Cut polygons into triangles; those that are not convex are cut by their outline.

    Of the numbers of corners (p,) and all corners one polygon after the other, (sum, 3): numbers of
    corners (t, 3), and their polygons (t,), ascending. Polygons of one or two corners give none.
    """
    begin = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
    number = np.maximum(counts - 2, 0)
    polygon = np.repeat(np.arange(len(counts)), number)
    step = np.arange(len(polygon)) - np.repeat(np.cumsum(number) - number, number)
    first = begin[polygon]
    corners = np.column_stack([first, first + step + 1, first + step + 2])
    for bad in _not_convex(counts, polygon, points[corners]):
        own = points[begin[bad] : begin[bad] + counts[bad]]
        cut = _cut(own)
        if len(cut) == number[bad]:
            corners[polygon == bad] = begin[bad] + cut
    return corners, polygon


def _not_convex(counts: Ints, polygon: Ints, corners: Floats) -> list[int]:
    """Polygons of which a triangle of the fan is turned against the whole."""
    if len(polygon) == len(counts):
        return []
    across = facet_vectors(corners)
    whole = np.zeros((len(counts), 3))
    np.add.at(whole, polygon, across)
    turned = np.einsum("tx,tx->t", across, whole[polygon]) < 0
    return [int(bad) for bad in np.unique(polygon[turned])]


def _cut(points: Floats) -> NDArray[Any]:
    """Triangles (t, 3) of one flat polygon (k, 3)."""
    from manifold3d import triangulate

    middle = points - points.mean(axis=0)
    axes = np.linalg.svd(middle, full_matrices=False)[2][:2]
    flat = middle @ axes.T
    x, y = flat.T
    order = np.arange(len(flat))
    if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0:
        order = order[::-1]
    cut = np.asarray(triangulate([flat[order]]), dtype=np.int64).reshape(-1, 3)
    turned = order[cut]
    return turned if order[0] == 0 else turned[:, ::-1]


def file_beside(mesh: Path, name: str) -> Path:
    """The file that a mesh names, or the one with its base name beside the mesh.

    InputError: there is none in the folder of the mesh; links that lead out do not count.
    """
    folder = mesh.parent.resolve()
    parts = PureWindowsPath(name.strip().strip('"')).parts  # takes both kinds of slashes
    wanted = Path(*parts) if parts else Path()
    for file in (wanted, Path(wanted.name)):
        found = _without_case(folder, file)
        if found is not None and found.resolve().is_relative_to(folder) and found.is_file():
            if found.stat().st_size > MAX_PICTURE_BYTES:
                raise InputError(f"{name} is over 1 GiB: reduce it")
            return found
    raise InputError(f"{name} is not in the folder of the mesh")


def uri_bytes(mesh: Path, uri: str) -> bytes:
    """The bytes that a URI holds, or those of a file beside the mesh."""
    if uri.startswith("data:"):
        return b64decode(uri.partition(",")[2])
    return file_beside(mesh, unquote(uri)).read_bytes()


def _without_case(folder: Path, file: Path) -> Path | None:
    """The file as it is spelt, or with other capitals where only these differ."""
    if not file.name or ".." in file.parts or file.is_absolute():
        return None
    if (folder / file).is_file():
        return folder / file
    parent = (folder / file).parent
    here = sorted(parent.iterdir()) if parent.is_dir() else []
    return next((p for p in here if p.name.casefold() == file.name.casefold()), None)


def textured(
    mesh: Path, part: ObjectPart, uv: Floats | None, name: str, notes: list[str]
) -> ObjectPart:
    """A part with the picture that its mesh names; as it is, and a fault, where that is lost."""
    if uv is None:
        notes.append(Fault(f"it names the texture {name}, but has no texture coordinates: {AGAIN}"))
        return part
    try:
        file = file_beside(mesh, name)
    except InputError as error:
        notes.append(Fault(f"its texture {error}: {BESIDE}"))
        return part
    picture = texture(file.read_bytes(), file.name, notes)
    if picture is None:
        return part
    source = f"texture {PureWindowsPath(name).name}"
    return replace(part, uv=uv, picture=picture, colours=None, source=source)


def texture(data: bytes, name: str, notes: list[str]) -> Bytes | None:
    """The picture of a texture, as bytes (h, w, 3); None, and a fault, where it cannot be read."""
    try:
        try:
            return shown_bytes(picture_of(data, name))
        except InputError:
            shown = shown_bytes(picture_of(data, name, ignore_alpha=True))
            notes.append(f"the transparency of its texture {name} is left out")
            return shown
    except InputError as error:
        notes.append(Fault(f"its texture {error}"))
        return None


def shown_bytes(picture: Picture) -> Bytes:
    """A picture (h, w) or (h, w, 3) as bytes (h, w, 3); real numbers are light."""
    if picture.dtype == np.uint16:
        picture = np.rint(picture / 257).astype(np.uint8)
    elif picture.dtype != np.uint8:
        picture = np.rint(255 * srgb(picture.astype(np.float64).clip(0, 1))).astype(np.uint8)
    return np.ascontiguousarray(np.dstack([picture] * 3) if picture.ndim == 2 else picture)
