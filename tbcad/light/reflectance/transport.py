"""The reflectance field of a simulated capture: each of its rays in the light of each lamp."""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tbcad.errors import InputError
from tbcad.light.datasets.crops import MirrorId
from tbcad.light.reflectance.field_file import NAME, RAYS_PER_CHUNK, SCHEMA
from tbcad.light.reflectance.lamp_places import LampPlaces, projectors
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField
from tbcad.light.simulate.capture.light_field_writer import (
    COMPRESSION_LEVEL,
    chunked,
    filtered_chunk,
)
from tbcad.light.simulate.capture.photograph import row_bands
from tbcad.light.simulate.parallel import chunks, in_batches, in_threads
from tbcad.light.simulate.scene.point_lights import Spots, received_light
from tbcad.light.simulate.scene.ray_casting import Scene, surface_hits
from tbcad.types import Colours, Floats, Ints, Progress

BYTES_PER_VALUE = 2
Light = Callable[[int, Spots], Floats]
"""Light (k,) of a lamp by its number on spots (k,)."""


@dataclass(frozen=True)
class SeenSpots:
    """What a camera's rays see of the object."""

    pixel: Ints  # row * width + column, ascending, (r,)
    spots: Spots  # where they meet it, (r,)
    albedo: Floats  # colours there, 0 to 1, (r, 3)


def write_reflectance(
    folder: Path,
    source: LightField,
    scene: Scene,
    lamps: LampPlaces,
    progress: Progress,
    thrown: bool = False,
) -> dict[str, Any]:
    """Write the file into the folder of a capture, and return what is in it.

    Args:
        folder: of the capture.
        source: its light field.
        scene: the object.
        lamps: one picture of each.
        progress: called with each lamp.
        thrown: lamps are mirrors by name, that throw the light of projectors.

    Raises:
        InputError: the file does not fit on the disk.
    """
    seen = {name: seen_spots(frame, scene) for name, frame in source.frames.items()}
    rays = sum(len(one.pixel) for one in seen.values())
    size = len(lamps.name) * rays * 3 * BYTES_PER_VALUE
    if size > shutil.disk_usage(folder).free:
        raise InputError(
            f"{len(lamps.name)} lamps for {rays} rays are {size / 1e9:.1f} GB, more than the disk "
            "has free: choose fewer lamps, as by --every"
        )
    kind = "projectors" if thrown else "points"
    facts = {"lamps": len(lamps.name), "rays": rays, "unpacked_bytes": size, "light": kind}
    light = thrown_light(scene, source, lamps) if thrown else point_lamps(scene, lamps)
    with h5py.File(folder / NAME, "w", libver=("v110", "v110")) as store:
        store.attrs["schema"], store.attrs["facts"] = SCHEMA, json.dumps(facts)
        group = store.create_group("lamps")  # by name and create_dataset: without times
        group.create_dataset("place", data=lamps.place)
        group.create_dataset("name", data=np.array(lamps.name, dtype="S"))
        for name, one in seen.items():
            _write_camera(store.create_group(name), one, light, lamps, progress)
    return facts


def seen_spots(frame: CameraFrame, scene: Scene) -> SeenSpots:
    """What the captured rays of a camera see of the object."""

    def band(rows: range) -> SeenSpots:
        part = frame.read(slice(rows.start, rows.stop))
        pixel = np.flatnonzero(part["mirror"]) + rows.start * frame.camera.width_px
        known = part["mirror"] > 0
        rays = (part[name][known].astype(np.float64) for name in ("origin", "direction"))
        hits = surface_hits(scene, *rays)
        subject = scene.subject
        return SeenSpots(pixel[hits.rows], hits.spots(subject), hits.albedo(subject))

    parts = in_threads(band, row_bands(frame.camera.height_px))
    names = ("place", "normal", "facet_normal")
    places = (np.concatenate([getattr(part.spots, name) for part in parts]) for name in names)
    return SeenSpots(
        np.concatenate([part.pixel for part in parts]),
        Spots(*places),
        np.concatenate([part.albedo for part in parts]),
    )


def point_lamps(scene: Scene, lamps: LampPlaces) -> Light:
    """The light of lamps that shine alike in all directions."""
    return lambda k, spots: received_light(scene.embree, spots, lamps.place[k])


def thrown_light(scene: Scene, source: LightField, lamps: LampPlaces) -> Light:
    """The light of projectors in the places of the cameras, by the mirrors of the lamps' names."""
    found = projectors(source, tuple(MirrorId(one[0], int(one[1:]) - 1) for one in lamps.name))
    return lambda k, spots: found.light(scene.embree, k, spots)


def transport(seen: SeenSpots, light: Light, lamp: int, rays: slice) -> Colours:
    """Light (r, 3) along some of the rays from a lamp by its number."""
    received = light(lamp, seen.spots.part(rays))
    return np.asarray(seen.albedo[rays] * received[:, None], dtype=np.float32)


def _write_camera(
    group: h5py.Group, seen: SeenSpots, light: Light, lamps: LampPlaces, progress: Progress
) -> None:
    """Write a picture for each lamp, as HDF5 would, but compress in several threads."""
    group.create_dataset("pixel", data=seen.pixel.astype(np.uint32), compression=COMPRESSION_LEVEL)
    count, rays = len(lamps.name), len(seen.pixel)
    chunk = (1, min(RAYS_PER_CHUNK, max(rays, 1)), 3)
    stored = chunked(group, "transport", "f2", (count, rays, 3), chunk)
    items = [(k, part) for k in range(count) for part in chunks(rays, chunk[1])]

    def packed(item: tuple[int, slice]) -> bytes:
        k, part = item
        return filtered_chunk(transport(seen, light, k, part).astype("<f2")[None], chunk)

    def begin(item: tuple[int, slice]) -> None:
        progress(f"camera {group.name[1:]}, lamp {lamps.name[item[0]]}")

    for (k, part), data in zip(items, in_batches(packed, items, begin), strict=True):
        stored.id.write_direct_chunk((k, part.start, 0), data)
