"""A folder of captures: both photographs, the light field, and the object they are of."""

import json
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import NAME
from tbcad.light.simulate.capture.light_field_writer import create_light_field, write_camera
from tbcad.light.simulate.capture.photograph import CameraPhotographs
from tbcad.light.simulate.image_files import write_images
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.types import Bytes, Ints

OBJECT, RECORD = "object.npz", "capture.json"
SCHEMA = "tbcad-capture/1"
MAX_OBJECT_BYTES = 4 << 30  # bytes, unpacked


def write_capture(
    folder: Path,
    photographs: CameraPhotographs,
    subject: SceneObject,
    capture_mm: float,
    facts: dict[str, Any],
) -> dict[str, Any]:
    """Write all files of a capture into a folder, and return its record.

    Args:
        folder: exists, and is the caller's to replace.
        photographs: each camera with a function that gives the bands of its picture.
        subject: the object before the cameras.
        capture_mm: diameter of the capture sphere.
        facts: how the capture is made.
    """
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
    """Write an object with all that gives its colours; the bytes are the same each time."""
    kept = (field.name for field in fields(subject) if field.name != "reading")
    values = {name: getattr(subject, name) for name in kept}
    arrays = {name: np.asarray(value) for name, value in values.items() if value is not None}
    np.savez_compressed(path, allow_pickle=False, **arrays)


def read_object(folder: Path) -> SceneObject:
    """Read the object of a capture.

    Raises:
        InputError: there is none, or it is damaged.
    """
    path = folder / OBJECT
    if not path.is_file():
        raise InputError(f"{path} is not there: without it there is no ground truth")
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


def _subject(arrays: dict[str, Any]) -> SceneObject:
    faces = arrays["faces"].astype(np.int64)
    points, normals, albedo = (
        arrays[name].astype(np.float64) for name in ("points", "normals", "albedo")
    )
    uv, texture = arrays.get("uv"), arrays.get("texture")
    v, f = len(points), len(faces)
    shapes = (points.shape, faces.shape, normals.shape, albedo.shape)
    if shapes != ((v, 3), (f, 3), (v, 3), (f, 3, 3)) or f == 0:
        raise ValueError("arrays do not belong together")
    if faces.min() < 0 or faces.max() >= v or not np.isfinite(points).all():
        raise ValueError("facets have corners that do not exist")
    light, tiles = arrays.get("light"), arrays.get("tiles")
    if light is not None and light.ndim == 1:  # of older captures: backs had the front's
        light = np.column_stack([light, light])
    if texture is not None and tiles is None:  # and the only texture was not multiplied
        tiles, albedo = np.tile([0, *texture.shape[:2]], (f, 1)), np.ones_like(albedo)
    if light is not None and (light.shape != (v, 2) or not np.isfinite(light).all()):
        raise ValueError("light and corners do not belong together")
    if (uv is None) != (texture is None) or (uv is not None and uv.shape != (f, 3, 2)):
        raise ValueError("a texture without its coordinates")
    if tiles is not None and not _are_within(tiles, texture, f):
        raise ValueError("a texture without its places")
    name, patterned = str(arrays["name"]), bool(arrays["patterned"])
    return SceneObject(name, points, faces, normals, albedo, uv, texture, tiles, patterned, light)


def _are_within(tiles: Ints, texture: Bytes | None, facets: int) -> bool:
    """Whether pictures (f, 3), by first row, height and width, are on a texture."""
    if texture is None or tiles.shape != (facets, 3) or tiles.min() < 0:
        return False
    used = tiles[tiles[:, 1] > 0]
    return bool(
        (used[:, 0] + used[:, 1] <= len(texture)).all()
        and ((used[:, 2] > 0) & (used[:, 2] <= texture.shape[1])).all()
    )
