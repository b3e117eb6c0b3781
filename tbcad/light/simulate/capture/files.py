"""A folder of captures: both photographs, the light field (see `light_field`), and the object."""

import json
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import MIRROR_ARRAYS, NAME, PIXEL_ARRAYS, band_arrays
from tbcad.light.simulate.capture.light_field import SCHEMA as LIGHT_FIELD_SCHEMA
from tbcad.light.simulate.capture.photograph import BAND_ROWS, CameraPhotographs, RowBand
from tbcad.light.simulate.image_files import write_images
from tbcad.light.simulate.parallel import in_threads
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Bytes, Ints

CHUNK = (BAND_ROWS, 256)
RAYS_PER_CHUNK = {"u1": 1 << 16, "f2": 1 << 15}  # 192 kB
COMPRESSION_LEVEL = 1  # higher ones save 2 % at most
OBJECT, RECORD = "object.npz", "capture.json"
SCHEMA = "tbcad-capture/1"
UNKEPT = {"reading", "finish"}  # of an object: not needed for its matt colours
TEXTURE = {"uv", "texture", "tiles"}  # arrays of an object that go together
MAX_OBJECT_BYTES = 4 << 30  # bytes, unpacked


@contextmanager
def create_light_field(
    path: Path, capture_mm: float, facts: Mapping[str, Any]
) -> Iterator[h5py.File]:
    """Create a file, which `write_camera` fills camera by camera."""
    with h5py.File(path, "w", libver=("v110", "v110")) as store:
        store.attrs["schema"] = LIGHT_FIELD_SCHEMA
        store.attrs["capture_mm"] = capture_mm
        store.attrs["facts"] = json.dumps(dict(facts), sort_keys=True)
        yield store


def write_camera(
    store: h5py.File, reflector: Reflector, bands: Iterable[RowBand]
) -> tuple[Bytes, dict[str, int]]:
    """Write one camera's bands as they come, each a row of chunks.

    Returns its picture (h, w, 3), and how many of its pixels are on mirrors, and of those how many
    rays meet the capture sphere.
    """
    camera, group = reflector.camera, store.create_group(reflector.camera_id)
    group.attrs["pinhole_mm"] = camera.pinhole
    group.attrs["forward"] = camera.forward
    group.attrs["right"] = camera.right
    group.attrs["hfov_rad"] = camera.hfov
    mirrors, table = reflector.mirrors, group.create_group("mirrors")
    columns = (reflector.u, mirrors.apex, mirrors.normal, mirrors.curvature, reflector.boxes())
    for name, values in zip(MIRROR_ARRAYS, columns, strict=True):
        table.create_dataset(name, data=values)
    shape = (camera.height_px, camera.width_px)
    chunk = (min(CHUNK[0], shape[0]), min(CHUNK[1], shape[1]))
    planes = {
        name: chunked(group, name, kind, shape + last, chunk + last)
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


def chunked(
    group: h5py.Group,
    name: str,
    kind: str,
    shape: tuple[int, ...],
    chunks: tuple[int, ...],
    most: tuple[int | None, ...] | None = None,
) -> h5py.Dataset:
    """An array in compressed chunks, which `filtered_chunk` makes too; it may grow to `most`."""
    filters = {"shuffle": True, "compression": COMPRESSION_LEVEL}
    return group.create_dataset(name, shape, kind, chunks=chunks, maxshape=most, **filters)


def create_rays(
    group: h5py.Group, name: str, kind: str, pixel: Ints, pictures: int | None
) -> h5py.Dataset:
    """Numbers of pixels (r,), and a table (pictures, r, 3) of them; None: it grows from nothing."""
    group.create_dataset("pixel", data=pixel.astype(np.uint32), compression=COMPRESSION_LEVEL)
    rays = len(pixel)
    chunk = (1, min(RAYS_PER_CHUNK[kind], max(rays, 1)), 3)
    most = (None, rays, 3) if pictures is None else None
    return chunked(group, name, kind, (pictures or 0, rays, 3), chunk, most)


def _write_chunks(planes: Mapping[str, h5py.Dataset], band: RowBand) -> None:
    """Write a band, a row of chunks, as HDF5 would, but compress in several threads."""
    arrays = band_arrays(band)
    width, step = band.colour.shape[1], planes["colour"].chunks[1]
    places = [(name, first) for name in PIXEL_ARRAYS for first in range(0, width, step)]

    def filtered(place: tuple[str, int]) -> bytes:
        name, first = place
        return filtered_chunk(arrays[name][:, first : first + step], planes[name].chunks)

    for (name, first), data in zip(places, in_threads(filtered, places), strict=True):
        offset = (band.rows.start, first, 0)[: arrays[name].ndim]
        planes[name].id.write_direct_chunk(offset, data)


def filtered_chunk(part: NDArray[Any], shape: tuple[int, ...]) -> bytes:
    """A chunk after HDF5's filters: filled up, bytes of equal weight side by side, deflated."""
    chunk = np.zeros(shape, dtype=part.dtype)
    chunk[: part.shape[0], : part.shape[1]] = part
    shuffled = chunk.reshape(-1, 1).view(np.uint8).T
    return zlib.compress(shuffled.tobytes(), COMPRESSION_LEVEL)


def write_capture(
    folder: Path,
    photographs: CameraPhotographs,
    subject: SceneObject,
    capture_mm: float,
    facts: dict[str, Any],
) -> dict[str, Any]:
    """Write all files of a capture, made as `facts` say, into an empty folder; its record."""
    record = capture_record({"object": subject.name, **facts})
    write_cameras(folder, photographs, capture_mm, record)
    write_object(folder / OBJECT, subject)
    write_record(folder, record)
    return record


def capture_record(facts: dict[str, Any]) -> dict[str, Any]:
    """The record of a capture, to which `write_cameras` adds the cameras."""
    return {"schema": SCHEMA, **facts, "cameras": {}}


def write_cameras(
    folder: Path, photographs: CameraPhotographs, capture_mm: float, record: dict[str, Any]
) -> None:
    """Write pictures and light field, and add what is in them to a record."""
    with create_light_field(folder / NAME, capture_mm, record) as store:
        for reflector, bands in photographs:
            picture, counts = write_camera(store, reflector, bands())
            file = folder / f"camera_{reflector.camera_id}.png"
            write_images({file: picture})
            record["cameras"][reflector.camera_id] = {"picture": file.name, **counts}


def write_record(folder: Path, record: dict[str, Any]) -> None:
    """Write capture.json."""
    text = json.dumps(record, indent=1) + "\n"
    (folder / RECORD).write_text(text, encoding="utf-8")


def write_object(path: Path, subject: SceneObject) -> None:
    """Write an object with all that gives its matt colours; the bytes are the same each time."""
    kept = (field.name for field in fields(subject) if field.name not in UNKEPT)
    values = {name: getattr(subject, name) for name in kept}
    arrays = {name: np.asarray(value) for name, value in values.items() if value is not None}
    np.savez_compressed(path, allow_pickle=False, **arrays)


def read_object(folder: Path) -> SceneObject:
    """Read the object of a capture, which is there; InputError: it is damaged."""
    path = folder / OBJECT
    try:
        with zipfile.ZipFile(path) as packed:
            if sum(entry.file_size for entry in packed.infolist()) > MAX_OBJECT_BYTES:
                raise InputError(f"{path} unpacks to over 4 GiB: capture again")
        with np.load(path, allow_pickle=False) as arrays:
            return _subject({name: arrays[name] for name in arrays.files})
    except InputError:
        raise
    except Exception as error:  # zip and numpy raise many kinds, of sizes that lie too
        raise InputError(f"{path} is damaged: {error}: capture again") from error


def captured_scene(folder: Path) -> Scene | None:
    """The object of a simulated capture; None where there is none, as with real photographs."""
    return prepared_scene(read_object(folder)) if (folder / OBJECT).is_file() else None


def _subject(arrays: dict[str, Any]) -> SceneObject:
    points, facets = len(arrays["points"]), len(arrays["faces"])
    shapes = {
        "points": (points, 3), "faces": (facets, 3), "normals": (points, 3),
        "albedo": (facets, 3, 3), "light": (points, 2), "uv": (facets, 3, 2), "tiles": (facets, 3),
    }  # fmt: skip
    for name in shapes.keys() & arrays.keys():
        if arrays[name].shape != shapes[name] or not np.isfinite(arrays[name]).all():
            raise ValueError(f"its {name} do not belong to its facets")
    faces = arrays["faces"]
    if not facets or faces.dtype != np.int64 or not 0 <= faces.min() <= faces.max() < points:
        raise ValueError("facets have corners that do not exist")
    textured = TEXTURE & arrays.keys()
    if textured and (textured != TEXTURE or not _are_within(arrays["tiles"], arrays["texture"])):
        raise ValueError("a texture without its places")
    texts = {"name": str(arrays["name"]), "patterned": bool(arrays["patterned"])}
    return SceneObject(**{**arrays, **texts})


def _are_within(tiles: Ints, texture: Bytes) -> bool:
    """Whether pictures (f, 3), by first row, height and width, are on a texture."""
    first, height, width = tiles[tiles[:, 1] > 0].T
    rows, columns = texture.shape[:2]
    return bool(((first >= 0) & (first + height <= rows) & (width > 0) & (width <= columns)).all())
