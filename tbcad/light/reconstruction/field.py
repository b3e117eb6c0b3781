"""A field: density and colour on a sparse grid; and its file.

The file is a NumPy archive (docs/reconstruct.md) with the arrays

    node      (v, 3)  uint16   place of each node in the lattice, 0 to nodes - 1 along x, y, z
    density   (v,)    float32  a number x, see below
    colour    (v, 3)  float32  red, green, blue, 0 to 1
    slope     (v, 9)  float32  of view-dependent fields: change of red, green, blue with the
                               direction of the ray, x, y, z each

and `nodes`, `capture_mm` and `facts` (JSON). Density, 1/mm, is (x + sqrt(x^2 + 0.01)) / 2 of the
number x between the nodes, 0 where a cell lacks a node.
"""

import json
import warnings
import zipfile
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tbcad.cad.formats.checked_files import parse_json
from tbcad.common.atomic_files import replace_files
from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.reconstruction.marching import GLOSSY, MATT, SOFTNESS, Singles
from tbcad.light.simulate.capture.light_field import NAME as LIGHT_FIELD
from tbcad.light.simulate.capture.light_field import SCHEMA as LIGHT_FIELD_SCHEMA
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField
from tbcad.types import Bools, Floats

SIDES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
LONGEST_LEAP = 255  # cells, that fit into a byte
SCHEMA = "tbcad-field/1"
SUFFIX = ".npz"
NAME = "field.npz"  # beside a light field, which it then shows
MOST_NODES = 1024  # along an edge
MOST_BYTES = 4 << 30
MOST_NUMBER = 1e6
FACT = "light_field"  # of a field: the fingerprint of what it was fitted to
ROWS_APART = 64  # of those whose rays are part of a fingerprint


@dataclass(frozen=True)
class Grid:
    """Nodes of a cubic lattice about the origin; v of its n^3 nodes are there.

    Between them values are interpolated linearly, in cells that have all eight corners.
    """

    n: int  # nodes along each edge of the cube
    width_mm: float  # of the cube
    place: NDArray[np.uint16]  # of the nodes in the lattice, in ascending order, (v, 3)

    @staticmethod
    def about(wanted: Bools, width_mm: float) -> "Grid":
        """The nodes of all cells that have a wanted node (n, n, n)."""
        nodes = ndimage.binary_dilation(wanted, np.ones((3, 3, 3), dtype=bool))
        return Grid(len(wanted), width_mm, np.argwhere(nodes).astype(np.uint16))

    def __len__(self) -> int:
        return len(self.place)

    @property
    def pitch_mm(self) -> float:
        """Distance of neighbouring nodes."""
        return self.width_mm / (self.n - 1)

    @cached_property
    def row(self) -> NDArray[np.int32]:
        """Number of each node of the lattice, -1 where it is not there, (n, n, n)."""
        rows = np.full((self.n,) * 3, -1, dtype=np.int32)
        rows[tuple(self.place.T)] = np.arange(len(self), dtype=np.int32)
        return rows

    @cached_property
    def leap(self) -> NDArray[np.uint8]:
        """Cells (n-1, n-1, n-1) from each to the nearest with all corners, along all axes at once.

        0 where it has them itself.
        """
        corners = np.lib.stride_tricks.sliding_window_view(self.row >= 0, (2, 2, 2))
        whole: Bools = np.asarray(corners.all(axis=(3, 4, 5)))
        if not whole.any():
            return np.full(whole.shape, LONGEST_LEAP, dtype=np.uint8)
        away = ndimage.distance_transform_cdt(~whole, "chessboard")
        return np.asarray(np.minimum(away, LONGEST_LEAP), dtype=np.uint8)

    @cached_property
    def neighbours(self) -> NDArray[np.int32]:
        """Numbers of the nodes on the six sides of each node, -1 where there is none, (v, 6)."""
        padded = np.pad(self.row, 1, constant_values=-1)
        at = self.place.astype(np.int64) + 1
        return np.stack([padded[tuple((at + side).T)] for side in SIDES], axis=1)

    @property
    def points(self) -> Floats:
        """Places of the nodes, mm, (v, 3)."""
        return np.asarray(self.place * self.pitch_mm - self.width_mm / 2, dtype=np.float64)

    def dense(self, values: NDArray[np.float32], missing: float = 0.0) -> NDArray[np.float32]:
        """Values of the nodes (v,) on the whole lattice, (n, n, n)."""
        result = np.full((self.n,) * 3, missing, dtype=np.float32)
        result[tuple(self.place.T)] = values
        return result

    def sampled(self, lattice: NDArray[np.float32]) -> NDArray[np.float32]:
        """A lattice (k, k, k) over the same cube at the nodes, linearly, (v,)."""
        at = self.place.T * ((len(lattice) - 1) / (self.n - 1))
        return np.asarray(ndimage.map_coordinates(lattice, at, order=1, mode="nearest"))


def resampled(lattice: NDArray[np.float32], n: int) -> NDArray[np.float32]:
    """A lattice (k, k, k) with n nodes along the same edges, linearly, (n, n, n)."""
    return np.asarray(ndimage.zoom(lattice, n / len(lattice), order=1, mode="nearest"))


@dataclass(frozen=True)
class Field:
    """Density and colour."""

    grid: Grid  # its nodes; their cube holds the capture sphere
    # of the nodes: number of the density, red, green, blue, 0 to 1, and of a field of first order
    # nine slopes, (v, 4 or 13)
    values: Singles
    facts: dict[str, Any] = field(default_factory=dict)  # how it was made

    @property
    def order(self) -> int:
        """Of the view dependence of colours: 0 or 1."""
        return int(self.values.shape[1] == GLOSSY)

    def density(self) -> Floats:
        """Density of the nodes, 1/mm, (v,)."""
        return density_of(self.values[:, 0])


def density_of(number: Singles) -> Floats:
    """Density, 1/mm, of the numbers that are interpolated."""
    x = number.astype(np.float64)
    return np.asarray((x + np.sqrt(x * x + float(SOFTNESS))) / 2)


def write_field(path: Path, made: Field) -> None:
    """Write a field, replacing the file atomically."""
    replace_files(path.parent, {path.name: field_bytes(made)})


def field_bytes(made: Field, **more: Singles) -> bytes:
    """The file of a field; with more arrays, of one under way, not compressed."""
    save = np.savez if more else np.savez_compressed
    arrays = {
        "schema": np.array(SCHEMA),
        "nodes": np.array(made.grid.n),
        "capture_mm": np.array(made.grid.width_mm),
        "node": made.grid.place,
        "density": made.values[:, 0],
        "colour": made.values[:, 1:MATT],
        "facts": np.array(json.dumps(made.facts, sort_keys=True)),
    }
    if made.order:
        arrays["slope"] = made.values[:, MATT:]
    with BytesIO() as buffer:
        save(buffer, allow_pickle=False, **arrays, **more)
        return buffer.getvalue()


def read_field(path: Path) -> Field:
    """Read a field; InputError: there is none, or it is damaged."""
    if not path.is_file():
        raise InputError(f"{path}: no such file; write it with `tbcad reconstruct`")
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(one.file_size for one in archive.infolist()) > MOST_BYTES:
                raise ValueError("it unpacks to more than 4 GB")
        return read_arrays(path)[0]
    except InputError:
        raise
    except Exception as fault:  # zip and numpy raise many kinds
        raise InputError(
            f"{path} is no field that tbcad wrote ({fault}): write it again with "
            "`tbcad reconstruct`"
        ) from None


def read_arrays(path: Path) -> tuple[Field, dict[str, Any]]:
    """A field and all arrays of its file; ValueError, and what zip and numpy raise: damaged."""
    with np.load(path, allow_pickle=False) as store:
        arrays = {name: store[name] for name in store.files}
    return _checked(arrays), arrays


def _checked(arrays: dict[str, Any]) -> Field:
    if str(arrays["schema"]) != SCHEMA:
        raise ValueError(f"its schema is not {SCHEMA}")
    n, width, place = int(arrays["nodes"]), float(arrays["capture_mm"]), arrays["node"]
    if arrays["nodes"].dtype.kind not in "iu" or not 2 <= n <= MOST_NODES or not 0 < width < np.inf:
        raise ValueError("its lattice cannot be")
    v = len(place)
    columns = [arrays["density"].reshape(v, 1), arrays["colour"].reshape(v, 3)]
    if "slope" in arrays:
        columns.append(arrays["slope"].reshape(v, 9))
    values = np.concatenate(columns, axis=1)
    if place.shape != (v, 3) or place.dtype != np.uint16 or (v and int(place.max()) >= n):
        raise ValueError("its nodes lie outside of their lattice")
    order = (place.astype(np.int64) * [n * n, n, 1]).sum(axis=1)
    if (np.diff(order) <= 0).any():
        raise ValueError("its nodes are not in ascending order")
    if values.dtype != np.float32 or not (np.abs(values) < MOST_NUMBER).all():
        raise ValueError("its numbers are too large, or of another kind")
    facts = parse_json(str(arrays["facts"]))
    if not isinstance(facts, dict):
        raise ValueError("its facts are no object")
    return Field(Grid(n, width, place), np.ascontiguousarray(values), facts)


def light_field_fingerprint(source: LightField) -> str:
    """SHA-256 of what was photographed, and of where: another light field has another one.

    Of the colours each pixel counts. Rays count by the cameras, the mirrors and one row in 64.
    """
    digest = sha256(
        json.dumps([LIGHT_FIELD_SCHEMA, source.capture_mm, sorted(source.frames)]).encode()
    )
    for _, frame in sorted(source.frames.items()):
        for values in _content(frame):
            digest.update(np.ascontiguousarray(values).data)
    return digest.hexdigest()


def _content(frame: CameraFrame) -> list[NDArray[np.generic]]:
    camera, mirrors = frame.camera, frame.mirrors
    rows = [np.asarray(frame.planes[name][::ROWS_APART]) for name in ("origin", "direction")]
    place = np.stack([camera.pinhole, camera.forward, camera.right])
    shapes = [place, frame.u, mirrors.apex, mirrors.normal, mirrors.curvature]
    return [frame.image(), *rows, *(np.asarray(one, dtype=np.float64) for one in shapes)]


def field_file(folder: Path, frame: int | None = None) -> Path:
    """Where the field of a capture lies, or of one frame of its sequence."""
    name = NAME if frame is None else NAME.replace(".", f"-{frame}.")
    return folder / name


def field_of(file: Path, source: LightField) -> Field:
    """Read the field of a light field.

    InputError: there is none, it is damaged, or it is of another light field.
    """
    made = read_field(file)
    again = "write it again with `tbcad reconstruct`"
    if FACT not in made.facts:
        raise InputError(f"{file} does not say of which light field it is: {again}")
    if made.facts[FACT] != light_field_fingerprint(source):
        raise InputError(f"{file} is of another capture, or of an older one: {again}")
    return made


def wanted_field(
    method: str | None, capture: Path, source: LightField, frame: int | None = None
) -> Field | None:
    """The field that views are made from; None: the light field itself.

    By default (method None) it is a field that lies beside the light field of a capture's folder or
    file; one that is of no use is told in a warning. InputError: as `field_of`, if method is
    "field".
    """
    file = field_file(capture if capture.is_dir() else capture.parent, frame)
    if method == "field":
        return field_of(file, source)
    beside = capture.is_dir() or capture.name == LIGHT_FIELD
    if method is not None or not beside or not file.is_file():
        return None
    try:
        return field_of(file, source)
    except InputError as fault:
        warnings.warn(PlausibilityWarning(f"{fault}; it is not used here"), stacklevel=2)
        return None
