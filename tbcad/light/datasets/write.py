"""A capture as a folder for another program, with the figures of how well it fits."""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.formats.colmap import SparseModel
from tbcad.errors import InputError
from tbcad.light.datasets.machine_scene import write_machine_scene
from tbcad.light.datasets.pictures import PinholePictures, crop_of, default_size, taken_pictures
from tbcad.light.datasets.pinholes import (
    SeedPoints,
    seed_points,
    write_nerfstudio,
    write_ngp_rays,
    write_pictures,
)
from tbcad.light.datasets.virtual_cameras import (
    FittedCameras,
    chosen_mirrors,
    reading_order,
    virtual_cameras,
)
from tbcad.light.simulate.capture.files import chunked
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.options.captures import DatasetOptions
from tbcad.types import Floats, Progress

SCHEMA = "tbcad-dataset/1"
RECORD, TABLE = "dataset.json", "cameras.csv"
DIGITS = 6
COLUMNS = ("name", "x", "y", "z", "rays", "pitch_mm", "rms_mm", "worst_mm", "central_error_mm")
MODEL = Path("sparse", "0")
# COLMAP looks for the mask of a0001.png as a0001.png.png.
MASK_SUFFIX = ".png.png"
RAYS, RAYS_H5 = "rays.npz", "rays.h5"
RAYS_PER_CHUNK = 1 << 16
RAY_COLUMNS: dict[str, tuple[str, tuple[int, ...]]] = {
    "origin": ("<f4", (3,)),
    "direction": ("<f4", (3,)),
    "colour": ("|u1", (3,)),
    "camera": ("<u2", ()),
}


def write_dataset(
    folder: Path, source: LightField, scene: Scene | None, options: DatasetOptions
) -> dict[str, Any]:
    """Write all files of a build into an empty folder, and return its record.

    `scene` is the object of a simulated capture. InputError: a mirror is not in the capture, or
    none gives a camera.
    """
    options.progress("virtual cameras")
    mirrors = chosen_mirrors(source, options.cameras, options.every)
    virtual = virtual_cameras(source, mirrors, options.detail)
    if not len(virtual):
        raise InputError("no mirror of the capture gives a virtual camera: choose other --cameras")
    figures = {
        "virtual_cameras": len(virtual),
        "left_out": virtual.left_out,
        **_written(folder, source, virtual, scene, options),
        "fit": _fit(virtual),
    }
    write_table(folder / TABLE, COLUMNS, _rows(virtual))
    return _record(folder, source, options.to, figures)


def write_scene(
    folder: Path, source: LightField, scene: Scene | None, exports: Path, progress: Progress
) -> dict[str, Any]:
    """Write scenes of the machine into an empty folder, and return their record.

    `exports` is the build that the light field was captured with. InputError: the capture names no
    object, or the build has other cameras or no shells.
    """
    if scene is None:
        raise InputError("the capture names no object, so there is none in the scene: capture one")
    export = read_export(exports)
    _check_same_cameras(source, export)
    return _record(folder, source, "mitsuba", write_machine_scene(folder, export, scene, progress))


def _record(
    folder: Path, source: LightField, target: str | None, figures: dict[str, Any]
) -> dict[str, Any]:
    """Write dataset.json, and return what it says."""
    record = {
        "schema": SCHEMA,
        "target": target,
        "capture": source.facts,
        "capture_mm": source.capture_mm,
        **figures,
    }
    text = json.dumps(record, indent=1, allow_nan=False) + "\n"
    (folder / RECORD).write_text(text, encoding="utf-8")
    return record


def _check_same_cameras(source: LightField, export: ExportedDesign) -> None:
    """Refuse a build whose mirrors are not those of the capture."""
    for reflector in export.reflectors:
        frame = source.frames.get(reflector.camera_id)
        if (
            frame is None
            or len(frame.u) != len(reflector)
            or frame.camera.width_px != reflector.camera.width_px
            or not np.allclose(frame.mirrors.apex, reflector.mirrors.apex, atol=1e-6)
        ):
            raise InputError(
                f"{export.folder} is not the build of this capture: its camera "
                f"{reflector.camera_id} has other mirrors or pixels: name the one it was taken with"
            )


def _written(
    folder: Path,
    source: LightField,
    virtual: FittedCameras,
    scene: Scene | None,
    options: DatasetOptions,
) -> dict[str, Any]:
    """Write what the target reads, and return what is in it."""
    progress, detail = options.progress, options.detail
    if options.to == "ngp-rays":
        progress("crops and rays")
        write_ngp_rays(folder, source, virtual, detail)
        return {"rays": int(virtual.rays.sum())}
    if options.to == "rays":
        progress("rays")
        return {"rays": write_ray_table(folder, source, virtual, detail)}
    progress("pictures")
    size = options.size or default_size(virtual, source.capture_mm)
    pictures, errors = taken_pictures(source, virtual, size, scene, detail)
    progress("seed points")
    cameras = virtual.pinhole_cameras(source.capture_mm, size)
    seeds = seed_points(cameras, pictures.picture, pictures.mask, source.capture_mm)
    progress("files")
    write = write_nerfstudio if options.to == "nerfstudio" else write_colmap
    write(folder, [one.name for one in virtual.mirrors], pictures, seeds)
    found = {
        "size_px": size,
        "seed_points": len(seeds.points),
        "known_pixels": round(float(pictures.mask.mean()), DIGITS),
    }
    if not len(errors):
        return found
    figures = {"rays": len(errors), "median": _rounded(np.median(errors))}
    figures["percentile_95"] = _rounded(np.percentile(errors, 95))
    return {**found, "reprojection_error_px": figures}


def _fit(virtual: FittedCameras) -> dict[str, dict[str, float]]:
    """Median and maximum over the virtual cameras, mm."""
    columns = {
        "rms_distance_from_common_point_mm": virtual.rms_mm,
        "worst_distance_from_common_point_mm": virtual.worst_mm,
        "central_error_at_capture_radius_mm": virtual.central_error_mm,
        "pixel_pitch_mm": virtual.pitch_mm,
    }
    return {
        name: {"median": _rounded(np.median(values)), "max": _rounded(values.max())}
        for name, values in columns.items()
    }


def _rounded(value: np.floating[Any]) -> float:
    return round(float(value), DIGITS)


def _rows(virtual: FittedCameras) -> Iterator[Row]:
    figures: Iterable[Floats] = np.column_stack(
        [virtual.pitch_mm, virtual.rms_mm, virtual.worst_mm, virtual.central_error_mm]
    )
    for mirror, centre, rays, row in zip(
        virtual.mirrors, virtual.centre.tolist(), virtual.rays, figures, strict=True
    ):
        cells = [mirror.name, *centre, int(rays), *np.round(row, DIGITS).tolist()]
        yield dict(zip(COLUMNS, cells, strict=True))


def write_colmap(
    folder: Path, names: list[str], pictures: PinholePictures, seeds: SeedPoints
) -> None:
    """Write images, masks and the sparse model into a folder that exists."""
    write_pictures(folder, names, pictures, MASK_SUFFIX)
    (folder / MODEL).mkdir(parents=True)
    count, size = pictures.mask.shape[:2]
    lens = [pictures.focal_px, pictures.focal_px, *np.full((2, count), size / 2)]
    model = SparseModel(
        tuple(f"{name}.png" for name in names),
        (size, size),
        np.column_stack(lens),
        pictures.axes,
        pictures.centre,
        seeds.points,
        seeds.colours,
    )
    for name, data in model.files().items():
        (folder / MODEL / name).write_bytes(data)


def write_ray_table(
    folder: Path, source: LightField, virtual: FittedCameras, progress: Progress
) -> int:
    """Write origin, direction, colour and virtual camera of the n rays that meet the sphere; n.

    As a NumPy archive, and the same arrays as HDF5, of which programs read parts.
    """
    total, first = int(virtual.rays.sum()), 0
    arrays: dict[str, NDArray[Any]] = {
        name: np.empty((total, *last), kind) for name, (kind, last) in RAY_COLUMNS.items()
    }
    for k in reading_order(source, virtual.mirrors).tolist():
        progress(virtual.mirrors[k].name)
        crop = crop_of(source, virtual.mirrors[k])
        part = slice(first, first := first + int(crop.meets.sum()))
        for name in ("origin", "direction", "colour"):
            arrays[name][part] = getattr(crop, name)[crop.meets]
        arrays["camera"][part] = k
    names = np.array([one.name for one in virtual.mirrors], dtype="<U8")
    progress(RAYS)
    np.savez_compressed(
        folder / RAYS, allow_pickle=False, **arrays, name=names, centre=virtual.centre
    )
    progress(RAYS_H5)
    with h5py.File(folder / RAYS_H5, "w", libver=("v110", "v110")) as store:
        rows = min(RAYS_PER_CHUNK, total)
        for name, (kind, last) in RAY_COLUMNS.items():
            chunked(store, name, kind, (total, *last), (rows, *last))
        for name, values in arrays.items():
            store[name][:] = values
        store.create_dataset("name", data=names.astype("S"))
        store.create_dataset("centre", data=virtual.centre)
    return total
