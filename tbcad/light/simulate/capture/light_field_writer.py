"""Writing of light fields as HDF5 files (see `light_field`), band by band."""

import json
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tbcad.light.simulate.capture.light_field import (
    MIRROR_ARRAYS,
    PIXEL_ARRAYS,
    SCHEMA,
    band_arrays,
)
from tbcad.light.simulate.capture.photograph import BAND_ROWS, RowBand
from tbcad.light.simulate.parallel import in_threads
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Bytes

CHUNK = (BAND_ROWS, 256)
COMPRESSION_LEVEL = 1  # higher ones save 2 % at most


@contextmanager
def create_light_field(
    path: Path, capture_mm: float, facts: Mapping[str, Any]
) -> Iterator[h5py.File]:
    """Create a file, which `write_camera` fills camera by camera."""
    with h5py.File(path, "w", libver=("v110", "v110")) as store:
        store.attrs["schema"] = SCHEMA
        store.attrs["capture_mm"] = capture_mm
        store.attrs["facts"] = json.dumps(dict(facts), sort_keys=True)
        yield store


def write_camera(
    store: h5py.File, reflector: Reflector, bands: Iterable[RowBand]
) -> tuple[Bytes, dict[str, int]]:
    """Write one camera's bands as they come, each a row of chunks.

    Returns:
        Its picture (h, w, 3), and how many of its pixels are on mirrors, and of those how many
        rays meet the capture sphere.
    """
    camera, group = reflector.camera, store.create_group(reflector.camera_id)
    group.attrs["pinhole_mm"] = camera.pinhole
    group.attrs["forward"] = camera.forward
    group.attrs["right"] = camera.right
    group.attrs["hfov_rad"] = camera.hfov
    _write_mirrors(group.create_group("mirrors"), reflector)
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


def _write_mirrors(group: h5py.Group, reflector: Reflector) -> None:
    mirrors = reflector.mirrors
    columns = (reflector.u, mirrors.apex, mirrors.normal, mirrors.curvature, reflector.boxes())
    for name, values in zip(MIRROR_ARRAYS, columns, strict=True):
        group.create_dataset(name, data=values)
