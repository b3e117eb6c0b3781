"""The light field as a file: for every pixel the ray it sees along, its colour and its mirror.

One HDF5 file (docs/light-field.md): every tool that matters to this field reads it, parts of it
can be read without the rest, and it is one file to copy. A group for each camera holds arrays of
the picture's size, in chunks, compressed:

    colour     (h, w, 3)  uint8    red, green, blue
    mirror     (h, w)     uint16   number of the mirror from 1; 0: no ray
    origin     (h, w, 3)  float32  where the ray leaves its mirror toward the object, mm
    direction  (h, w, 3)  float32  unit vector toward the object

and `mirrors` with u, apex, normal (m, 3) and curvature (m,), float64, and boxes (m, 4), int64:
columns x0, x1 and rows y0, y1, ends excluded, that hold all of a mirror's pixels.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.optics.camera import Camera
from tbcad.optics.surfaces import Surfaces
from tbcad.simulate.capture.photograph import BAND_ROWS, Band
from tbcad.simulate.parallel import in_threads
from tbcad.simulate.scene.reflector import Reflector
from tbcad.types import Floats

NAME = "lightfield.h5"
SCHEMA = "tbcad-lightfield/1"
CHUNK = (BAND_ROWS, 256)
COMPRESSION_LEVEL = 1  # of compression: higher ones save 2 % at most
PIXEL_ARRAYS: dict[str, tuple[tuple[int, ...], str]] = {
    "colour": ((3,), "u1"),
    "mirror": ((), "u2"),
    "origin": ((3,), "f4"),
    "direction": ((3,), "f4"),
}
MIRROR_ARRAYS = ("u", "apex", "normal", "curvature", "boxes")


@dataclass(frozen=True)
class Frame:
    """One camera's share of a light field; its arrays may lie in a file and are read by slices.

    Attributes:
        view: the camera.
        u: directions of the virtual cameras, (m, 3).
        mirrors: surfaces, (m,).
        boxes: columns x0, x1 and rows y0, y1, ends excluded, that hold each mirror, (m, 4).
        planes: arrays `colour`, `mirror`, `origin`, `direction` as above.
    """

    view: Camera
    u: Floats
    mirrors: Surfaces
    boxes: NDArray[np.int64]
    planes: Mapping[str, Any]

    def read(self, rows: slice, columns: slice = slice(None)) -> dict[str, NDArray[Any]]:
        """All arrays of a part of the picture."""
        return {name: np.asarray(plane[rows, columns]) for name, plane in self.planes.items()}

    def in_memory(self) -> Frame:
        """The same with all arrays in memory."""
        return replace(self, planes=self.read(slice(None)))

    def image(self) -> NDArray[np.uint8]:
        """The picture, (h, w, 3)."""
        return np.asarray(self.planes["colour"][:])


@dataclass(frozen=True)
class LightField:
    """A light field, in memory or in an open file.

    Attributes:
        frames: by camera, "a" and "b" or one of them.
        capture_mm: diameter of the capture sphere.
        facts: how it was made: name of the object, geometry, samples a pixel ...
    """

    frames: dict[str, Frame]
    capture_mm: float
    facts: dict[str, Any]

    @staticmethod
    @contextmanager
    def open(path: Path) -> Iterator[LightField]:
        """Open a file, or the file in a folder that `tbcad capture` wrote, for reading.

        Raises:
            InputError: it cannot be read, or is no light field of this schema.
        """
        file = path / NAME if path.is_dir() else path
        with _opened(file) as store:
            yield _read(file, store)

    @staticmethod
    def read(path: Path) -> LightField:
        """Read a whole file, or the file in a folder that `tbcad capture` wrote, into memory.

        Raises:
            InputError: as `open`.
        """
        with LightField.open(path) as stored:
            frames = {name: frame.in_memory() for name, frame in stored.frames.items()}
            return replace(stored, frames=frames)

    def __len__(self) -> int:
        """Number of mirrors."""
        return sum(len(frame.u) for frame in self.frames.values())

    def __repr__(self) -> str:
        """Return object, cameras and numbers of mirrors and pixels."""
        sizes = ", ".join(
            f"camera {name}: {len(frame.u)} mirrors, {frame.view.width_px} x {frame.view.height_px}"
            for name, frame in self.frames.items()
        )
        return f"<LightField of {self.facts.get('object', 'an object')}: {sizes}>"


@contextmanager
def create_light_field(
    path: Path, capture_mm: float, facts: Mapping[str, Any]
) -> Iterator[h5py.File]:
    """Make a file; `write` fills it camera by camera."""
    with h5py.File(path, "w", libver=("v110", "v110")) as store:
        store.attrs["schema"] = SCHEMA
        store.attrs["capture_mm"] = capture_mm
        store.attrs["facts"] = json.dumps(dict(facts), sort_keys=True)
        yield store


def write_camera(
    store: h5py.File, at: Reflector, bands: Iterable[Band]
) -> tuple[NDArray[np.uint8], dict[str, int]]:
    """Write one camera's bands as they come, each a row of chunks.

    Returns:
        Its picture (h, w, 3), and how many of its pixels are on mirrors, and of those how many
        rays meet the capture sphere.
    """
    view, group = at.camera, store.create_group(at.camera_id)
    _write_view(group, view)
    _write_mirrors(group.create_group("mirrors"), at)
    shape = (view.height_px, view.width_px)
    chunk = (min(CHUNK[0], shape[0]), min(CHUNK[1], shape[1]))
    planes = {
        name: group.create_dataset(
            name,
            shape + last,
            kind,
            chunks=chunk + last,
            shuffle=True,
            compression=COMPRESSION_LEVEL,
        )
        for name, (last, kind) in PIXEL_ARRAYS.items()
    }
    picture = np.zeros((*shape, 3), dtype=np.uint8)
    counts = {"pixels_on_mirrors": 0, "pixels_that_see_the_capture_sphere": 0}
    radius = float(store.attrs["capture_mm"]) / 2
    for band in bands:
        counts["pixels_on_mirrors"] += int((band.rays.mirror > 0).sum())
        counts["pixels_that_see_the_capture_sphere"] += int(band.rays.meeting(radius).sum())
        rows = slice(band.rows.start, band.rows.stop)
        picture[rows] = band.colour
        _write_chunks(planes, band)
    return picture, counts


def _write_chunks(planes: Mapping[str, h5py.Dataset], band: Band) -> None:
    """Write a band, a row of chunks, as HDF5 would, but compress in threads: it does in one."""
    arrays = band_arrays(band)
    width, step = band.colour.shape[1], planes["colour"].chunks[1]
    places = [(name, first) for name in PIXEL_ARRAYS for first in range(0, width, step)]

    def packed(place: tuple[str, int]) -> bytes:
        name, first = place
        return _packed(arrays[name][:, first : first + step], planes[name].chunks)

    for (name, first), data in zip(places, in_threads(packed, places), strict=True):
        offset = (band.rows.start, first, 0)[: arrays[name].ndim]
        planes[name].id.write_direct_chunk(offset, data)


def _packed(part: NDArray[Any], shape: tuple[int, ...]) -> bytes:
    """A chunk after HDF5's filters: filled up, bytes of equal weight side by side, deflated."""
    whole = np.zeros(shape, dtype=part.dtype)
    whole[: part.shape[0], : part.shape[1]] = part
    shuffled = whole.reshape(-1, 1).view(np.uint8).T
    return zlib.compress(shuffled.tobytes(), COMPRESSION_LEVEL)


def band_arrays(band: Band) -> dict[str, NDArray[Any]]:
    """The arrays of a band as the file has them."""
    rays = band.rays
    raw = (band.colour, rays.mirror, rays.origin, rays.direction)
    return {
        name: np.asarray(values, dtype=kind)
        for (name, (_, kind)), values in zip(PIXEL_ARRAYS.items(), raw, strict=True)
    }


def light_field_in_memory(
    captured: Mapping[str, tuple[Reflector, Iterable[Band]]],
    capture_mm: float,
    facts: Mapping[str, Any] = MappingProxyType({}),
) -> LightField:
    """A light field that is in no file."""
    frames = {}
    for camera, (at, bands) in captured.items():
        parts = [band_arrays(band) for band in bands]
        planes = {name: np.concatenate([part[name] for part in parts]) for name in PIXEL_ARRAYS}
        frames[camera] = Frame(at.camera, at.u, at.mirrors, at.boxes(), planes)
    return LightField(frames, capture_mm, dict(facts))


def _write_view(group: h5py.Group, view: Camera) -> None:
    group.attrs["pinhole_mm"] = view.pinhole
    group.attrs["forward"] = view.forward
    group.attrs["right"] = view.right
    group.attrs["hfov_rad"] = view.hfov


def _write_mirrors(group: h5py.Group, at: Reflector) -> None:
    mirrors = at.mirrors
    columns = (at.u, mirrors.apex, mirrors.normal, mirrors.curvature, at.boxes())
    for name, values in zip(MIRROR_ARRAYS, columns, strict=True):
        group.create_dataset(name, data=values)


@contextmanager
def _opened(file: Path) -> Iterator[h5py.File]:
    if not file.is_file():
        raise InputError(f"{file} is no file: name a folder that tbcad capture wrote")
    try:
        store = h5py.File(file, "r")
    except OSError as error:
        raise InputError(f"{file} is no light field: {error}: capture again") from error
    with store:
        yield store


def _read(file: Path, store: h5py.File) -> LightField:
    found = store.attrs.get("schema")
    if found != SCHEMA:
        raise InputError(
            f"{file} has schema {found!r}, allowed is {SCHEMA!r}: capture again with this tbcad"
        )
    try:
        frames = {name: _frame(_group(store, name)) for name in ("a", "b") if name in store}
        capture_mm = float(store.attrs["capture_mm"])
        facts = json.loads(store.attrs["facts"])
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise InputError(f"{file} is a damaged light field: {error}: capture again") from error
    if not frames or not np.isfinite(capture_mm) or capture_mm <= 0 or not isinstance(facts, dict):
        raise InputError(f"{file} is a damaged light field, without cameras: capture again")
    return LightField(frames, capture_mm, facts)


def _group(store: h5py.Group, name: str) -> h5py.Group:
    if not isinstance(store.get(name, getlink=True), h5py.HardLink):
        raise ValueError(f"group {name} is missing or lies elsewhere")
    return store[name]


def _inside(group: h5py.Group, name: str) -> h5py.Dataset:
    """An array that lies in this very file: a link could name any other."""
    link = group.get(name, getlink=True)
    if not isinstance(link, h5py.HardLink):
        raise ValueError(f"array {name} of {group.name} is missing or lies elsewhere")
    found = group[name]
    if not isinstance(found, h5py.Dataset) or found.external or found.is_virtual:
        raise ValueError(f"array {name} of {group.name} lies elsewhere")
    return found


def _frame(group: h5py.Group) -> Frame:
    planes = {name: _inside(group, name) for name in PIXEL_ARRAYS}
    height, width = planes["mirror"].shape
    for name, (last, kind) in PIXEL_ARRAYS.items():
        if planes[name].shape != (height, width, *last) or planes[name].dtype != np.dtype(kind):
            raise ValueError(f"array {name} of {group.name} has another shape or kind")
    attributes = group.attrs
    pinhole, forward, right = (
        _numbers(attributes[name], (3,)) for name in ("pinhole_mm", "forward", "right")
    )
    hfov = float(_numbers(attributes["hfov_rad"], ()))
    table = _group(group, "mirrors")
    columns = {name: _inside(table, name)[:] for name in MIRROR_ARRAYS}
    m = len(columns["curvature"])
    u, apex, normal = (_numbers(columns[name], (m, 3)) for name in ("u", "apex", "normal"))
    mirrors = Surfaces(apex, normal, _numbers(columns["curvature"], (m,)))
    boxes = columns["boxes"]
    inside = (boxes >= 0) & (boxes <= np.repeat([width, height], 2))
    if boxes.shape != (m, 4) or boxes.dtype != np.int64 or not inside.all():
        raise ValueError("boxes of mirrors lie outside of the picture")
    return Frame(Camera(pinhole, forward, right, width, height, hfov), u, mirrors, boxes, planes)


def _numbers(values: Any, shape: tuple[int, ...]) -> Floats:
    result = np.asarray(values, dtype=np.float64)
    if result.shape != shape or not np.isfinite(result).all():
        raise ValueError("numbers are missing or not finite")
    return result
