"""The light field, in memory or as a file: ray, colour and mirror of every pixel.

One HDF5 file (docs/light-field.md): most tools read it, parts of it can be
read without the rest, and it is one file to copy. A group for each camera holds arrays of
the picture's size, in chunks, compressed:

    colour     (h, w, 3)  uint8    red, green, blue
    mirror     (h, w)     uint16   number of the mirror from 1; 0: no ray
    origin     (h, w, 3)  float32  where the ray leaves its mirror toward the object, mm
    direction  (h, w, 3)  float32  unit vector toward the object

and `mirrors` with u, apex, normal (m, 3) and curvature (m,), float64, and boxes (m, 4), int64:
columns x0, x1 and rows y0, y1, ends excluded, that hold all of a mirror's pixels.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.hdf5 import StoredGroup, opened_hdf5
from tbcad.common.figure_files import image_bytes
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.surfaces import Surfaces
from tbcad.light.simulate.capture.photograph import CENTRE, RowBand, seen_by, to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import Shift, TracedRays, part_tracer, unit_directions
from tbcad.light.simulate.scene.reflector import Reflector, reflectors
from tbcad.options.checks import check_is_capture
from tbcad.types import Bytes, Floats, Ints

NAME = "lightfield.h5"
SCHEMA = "tbcad-lightfield/1"
# Fact of a merged run: by camera, root mean square error of each mirror's rays at the object, mm.
RAY_SIGMAS = "ray_sigma_mm"
SHOWN_PX = 1200  # width of what notebooks show
PIXEL_ARRAYS: dict[str, tuple[tuple[int, ...], str]] = {
    "colour": ((3,), "u1"),
    "mirror": ((), "u2"),
    "origin": ((3,), "f4"),
    "direction": ((3,), "f4"),
}
MIRROR_ARRAYS = ("u", "apex", "normal", "curvature", "boxes")
PartTracer = Callable[[range, range, Shift], TracedRays]


@dataclass(frozen=True)
class CameraFrame:
    """One camera's share of a light field; its arrays may lie in a file and are read by slices."""

    camera: Camera  # its pinhole, axes and sensor
    u: Floats  # directions of the virtual cameras, (m, 3)
    mirrors: Surfaces  # surfaces, (m,)
    # columns x0, x1 and rows y0, y1, ends excluded, that hold each mirror, (m, 4)
    boxes: NDArray[np.int64]
    planes: Mapping[str, Any]  # arrays `colour`, `mirror`, `origin`, `direction` as above

    def read(self, rows: slice, columns: slice = slice(None)) -> dict[str, NDArray[Any]]:
        """All arrays of a part of the picture."""
        return {name: np.asarray(plane[rows, columns]) for name, plane in self.planes.items()}

    def coloured(self, pixel: Ints, colour: Bytes) -> "CameraFrame":
        """The frame in colours (r, 3) of pixels (r,), counted row by row; others are black."""
        shape = self.camera.height_px, self.camera.width_px
        picture = np.zeros((shape[0] * shape[1], 3), dtype=np.uint8)
        picture[pixel] = colour
        return replace(self, planes={**self.planes, "colour": picture.reshape(*shape, 3)})

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

    frames: dict[str, CameraFrame]
    capture_mm: float
    facts: dict[str, Any]

    _store: h5py.File | None = field(default=None, repr=False, compare=False)

    @staticmethod
    def open(path: Path | str) -> "LightField":
        """Open a file, or the file in a folder that `tbcad capture` wrote, for reading.

        The file is closed at the end of a `with` block, by `close`, or when nothing of it is used.

        InputError: it cannot be read, or is no light field of this schema.
        """
        check_is_capture(Path(path))
        file = Path(path) / NAME if Path(path).is_dir() else Path(path)
        store, found = opened_hdf5(file, SCHEMA, "light field", "capture again", _read)
        return replace(found, _store=store)

    def close(self) -> None:
        """Close the file, if it is in one."""
        if self._store is not None:
            self._store.close()

    def __enter__(self) -> "LightField":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @staticmethod
    def read(path: Path | str) -> "LightField":
        """Read a whole file, or the file in a folder that `tbcad capture` wrote, into memory.

        InputError: as `open`.
        """
        with LightField.open(path) as stored:
            frames = {
                name: replace(frame, planes=frame.read(slice(None)))
                for name, frame in stored.frames.items()
            }
            return replace(stored, frames=frames, _store=None)

    def __len__(self) -> int:
        return sum(len(frame.u) for frame in self.frames.values())

    def __repr__(self) -> str:
        sizes = ", ".join(
            f"camera {name}: {len(frame.u)} mirrors, {camera.width_px} x {camera.height_px}"
            for name, frame in self.frames.items()
            for camera in [frame.camera]
        )
        return f"<LightField of {self.facts.get('object', 'an object')}: {sizes}>"

    def _repr_png_(self) -> bytes:
        """What notebooks show: the photographs side by side."""
        images = [frame.image() for frame in self.frames.values()]
        rows = min(len(image) for image in images)
        whole = np.concatenate([image[:rows] for image in images], axis=1)
        step = -(-max(whole.shape) // SHOWN_PX)
        return image_bytes(whole[::step, ::step])


def band_arrays(band: RowBand) -> dict[str, NDArray[Any]]:
    """The arrays of a band as the file has them."""
    rays = band.rays
    raw = (band.colour, rays.mirror, rays.origin, rays.direction)
    return {
        name: np.asarray(values, dtype=kind)
        for (name, (_, kind)), values in zip(PIXEL_ARRAYS.items(), raw, strict=True)
    }


def light_field_in_memory(
    photographs: Iterable[tuple[Reflector, Iterable[RowBand]]],
    capture_mm: float,
    facts: Mapping[str, Any] = MappingProxyType({}),
) -> LightField:
    """A light field that is in no file, from each camera with the bands of its picture."""
    frames = {}
    for reflector, bands in photographs:
        parts = [band_arrays(band) for band in bands]
        planes = {name: np.concatenate([part[name] for part in parts]) for name in PIXEL_ARRAYS}
        frames[reflector.camera_id] = CameraFrame(
            reflector.camera, reflector.u, reflector.mirrors, reflector.boxes(), planes
        )
    return LightField(frames, capture_mm, dict(facts))


def _read(store: StoredGroup) -> LightField:
    frames = {name: _frame(store.group(name)) for name in ("a", "b") if name in store}
    capture_mm = float(store.attributes["capture_mm"])
    if not frames or not np.isfinite(capture_mm) or capture_mm <= 0:
        raise ValueError("it is without cameras or capture sphere")
    return LightField(frames, capture_mm, store.facts)


def _frame(group: StoredGroup) -> CameraFrame:
    planes = {name: group.array(name) for name in PIXEL_ARRAYS}
    height, width = planes["mirror"].shape
    for name, (last, kind) in PIXEL_ARRAYS.items():
        if planes[name].shape != (height, width, *last) or planes[name].dtype != np.dtype(kind):
            raise ValueError(f"array {name} has another shape or kind")
    attributes = group.attributes
    pinhole, forward, right = (
        _numbers(attributes[name], (3,)) for name in ("pinhole_mm", "forward", "right")
    )
    hfov = float(_numbers(attributes["hfov_rad"], ()))
    table = group.group("mirrors")
    columns = {name: table.array(name)[:] for name in MIRROR_ARRAYS}
    m = len(columns["curvature"])
    u, apex, normal = (_numbers(columns[name], (m, 3)) for name in ("u", "apex", "normal"))
    mirrors = Surfaces(apex, normal, _numbers(columns["curvature"], (m,)))
    boxes = columns["boxes"]
    inside = (boxes >= 0) & (boxes <= np.repeat([width, height], 2))
    if boxes.shape != (m, 4) or boxes.dtype != np.int64 or not inside.all():
        raise ValueError("boxes of mirrors lie outside of the picture")
    return CameraFrame(
        Camera(pinhole, forward, right, width, height, hfov), u, mirrors, boxes, planes
    )


def _numbers(values: Any, shape: tuple[int, ...]) -> Floats:
    result = np.asarray(values, dtype=np.float64)
    if result.shape != shape or not np.isfinite(result).all():
        raise ValueError("numbers are missing or not finite")
    return result


@dataclass(frozen=True)
class TracedFrame(CameraFrame):
    """A frame without arrays: its pixels are those of a photograph with one ray a pixel."""

    trace: PartTracer  # gives the rays of rows and columns after the mirrors
    scene: Scene  # the object

    def read(self, rows: slice, columns: slice = slice(None)) -> dict[str, NDArray[Any]]:
        """All arrays of a part of the picture, traced anew."""
        lines = range(*rows.indices(self.camera.height_px))
        across = range(*columns.indices(self.camera.width_px))
        direction = unit_directions(self.camera, lines)[:, across.start : across.stop]
        traced = self.trace(lines, across, CENTRE)
        rays, colour = seen_by(self.camera, traced, np.ascontiguousarray(direction), self.scene)
        return band_arrays(RowBand(lines, rays, to_bytes(colour)))


def traced_light_field(design: MirrorDesign, scene: Scene) -> LightField:
    """The light field of a design whose pixels are traced when they are read."""
    frames: dict[str, CameraFrame] = {
        at.camera_id: TracedFrame(
            *(at.camera, at.u, at.mirrors, at.boxes(), MappingProxyType({})),
            *(part_tracer(at), scene),
        )
        for at in reflectors(design)
    }
    return LightField(frames, design.spec.optics.capture_diameter_mm, {})
