"""All rays as arrays in one NPZ and one HDF5 file, written in parts so that few are in memory."""

import zipfile
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from tbcad.light.datasets.pictures import crop_of
from tbcad.light.datasets.virtual_cameras import FittedCameras, reading_order
from tbcad.light.simulate.capture.files import chunked
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.types import Progress

RAYS, RAYS_H5 = "rays.npz", "rays.h5"
RAYS_PER_CHUNK = 1 << 16
# Zip files have times; a fixed one gives the same bytes each time.
NO_TIME = (1980, 1, 1, 0, 0, 0)
COLUMNS: dict[str, tuple[str, tuple[int, ...]]] = {
    "origin": ("<f4", (3,)),
    "direction": ("<f4", (3,)),
    "colour": ("|u1", (3,)),
    "camera": ("<u2", ()),
}


def write_ray_table(
    folder: Path, source: LightField, virtual: FittedCameras, progress: Progress
) -> int:
    """Write origin, direction, colour and virtual camera of each ray that meets the sphere.

    Returns:
        The number of rays.
    """
    total = int(virtual.rays.sum())
    with zipfile.ZipFile(folder / RAYS, "w") as packed:
        for name, (kind, last) in COLUMNS.items():
            progress(name)
            header = {"descr": kind, "fortran_order": False, "shape": (total, *last)}
            with packed.open(_entry(name), "w", force_zip64=True) as file:
                npy.write_array_header_1_0(file, header)
                for values in _values(source, virtual, name):
                    file.write(values.astype(kind).tobytes())
        for name, table in _tables(virtual).items():
            with packed.open(_entry(name), "w") as file:
                npy.write_array(file, table, allow_pickle=False)
    progress(RAYS_H5)
    _write_h5(folder / RAYS_H5, source, virtual, total)
    return total


def _write_h5(path: Path, source: LightField, virtual: FittedCameras, total: int) -> None:
    """The same arrays, of which programs read parts."""
    with h5py.File(path, "w", libver=("v110", "v110")) as store:
        stored = {
            name: chunked(store, name, kind, (total, *last), (min(RAYS_PER_CHUNK, total), *last))
            for name, (kind, last) in COLUMNS.items()
        }
        for name in COLUMNS:
            first = 0
            for values in _values(source, virtual, name):
                stored[name][first : first + len(values)] = values
                first += len(values)
        tables = _tables(virtual)
        store.create_dataset("name", data=tables["name"].astype("S"))
        store.create_dataset("centre", data=tables["centre"])


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(f"{name}.npy", NO_TIME)
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry


def _values(source: LightField, virtual: FittedCameras, name: str) -> Iterator[NDArray[np.generic]]:
    for k in reading_order(source, virtual.mirrors).tolist():
        crop = crop_of(source, virtual.mirrors[k])
        yield np.full(crop.meets.sum(), k) if name == "camera" else getattr(crop, name)[crop.meets]


def _tables(virtual: FittedCameras) -> dict[str, NDArray[np.generic]]:
    names = np.array([one.name for one in virtual.mirrors], dtype="<U8")
    return {"name": names, "centre": virtual.centre}
