"""The reflectance field: the light that each lamp sends along each captured ray.

One HDF5 file beside the light field's (docs/relighting.md), whose rays it is about:

    lamps/place      (l, 3)     float64  mm
    lamps/name       (l,)       text
    a/pixel          (r,)       uint32   row * width + column of the rays that meet the object
    a/transport      (l, r, 3)  float16  red, green, blue; and the same for b

A lamp gives 1 to a white surface at the origin that faces it. Light adds up, so the picture in any
light is the sum over the lamps of their colours times their transport.
"""

import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tbcad.cad.formats.hdf5 import StoredGroup, open_hdf5
from tbcad.errors import InputError
from tbcad.light.datasets.virtual_cameras import MirrorId
from tbcad.light.reflectance.environment import Environment
from tbcad.light.reflectance.lamp_places import LampPlaces, projectors
from tbcad.light.simulate.capture.files import create_rays, filtered_chunk
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField
from tbcad.light.simulate.capture.photograph import row_bands, to_bytes
from tbcad.light.simulate.parallel import chunks, in_batches, in_threads, over_chunks
from tbcad.light.simulate.scene.lamps import PointLights, Spots, received_light
from tbcad.light.simulate.scene.ray_casting import Scene, surface_hits
from tbcad.types import Colours, Floats, Ints, Progress

NAME = "reflectance.h5"
SCHEMA = "tbcad-reflectance/1"
RAYS_PER_CHUNK = 1 << 15
LAMPS_AT_ONCE = 64
AGAIN = "capture again with --lights"
# Percentile of the light along rays that a photograph shows as white.
EXPOSED = 99.5
# Directions of the sky that the ground truth is lit from.
TRUE_LIGHTS = 512
BYTES_PER_VALUE = 2
Light = Callable[[int, Spots], Floats]  # light (k,) of a lamp by its number on spots (k,)


@dataclass(frozen=True)
class ReflectanceField:
    """A reflectance field in an open file."""

    lamps: LampPlaces  # (l,)
    pixel: Mapping[str, Any]  # of each camera, numbers of the rays that meet the object, (r,)
    transport: Mapping[str, Any]  # of each camera, (l, r, 3), read by slices
    facts: dict[str, Any]  # how it was made

    def lit(self, camera: str, colour: Floats) -> Colours:
        """Light (r, 3) along a camera's rays when the lamps have colours (l, 3)."""
        stored = self.transport[camera]
        weight = colour.astype(np.float32)

        def part(rays: slice) -> Colours:
            total = np.zeros((rays.stop - rays.start, 3), dtype=np.float32)
            for some in chunks(len(weight), LAMPS_AT_ONCE):
                values = stored[some, rays].astype(np.float32)
                total += np.einsum("lrc,lc->rc", values, weight[some])
            return total

        return over_chunks(part, stored.shape[1], RAYS_PER_CHUNK)


@contextmanager
def open_reflectance(folder: Path) -> Iterator[ReflectanceField]:
    """Open the reflectance field of a capture for reading.

    InputError: there is none, or it is damaged.
    """
    file = (folder if folder.is_dir() else folder.parent) / NAME
    if not file.is_file():
        raise InputError(f"{file}: no such file, so no other light is known: {AGAIN}")
    with open_hdf5(file, SCHEMA, "reflectance field", AGAIN, _read) as stored:
        yield stored


def _read(store: StoredGroup) -> ReflectanceField:
    lamps = store.group("lamps")
    place = np.asarray(lamps.array("place")[:], dtype=np.float64)
    names = tuple(name.decode() for name in lamps.array("name")[:])
    if place.shape != (len(names), 3) or not np.isfinite(place).all():
        raise ValueError("lamps lack names or places")
    cameras = {name: store.group(name) for name in ("a", "b") if name in store}
    pixel = {name: one.array("pixel") for name, one in cameras.items()}
    transport = {name: one.array("transport") for name, one in cameras.items()}
    for name in cameras:
        rays = pixel[name].shape
        if len(rays) != 1 or pixel[name].dtype != np.uint32:
            raise ValueError(f"pixels of camera {name} have another shape or kind")
        if transport[name].shape != (len(names), *rays, 3) or transport[name].dtype != np.float16:
            raise ValueError(f"transport of camera {name} has another shape or kind than its rays")
    numbers = {name: one[:].astype(np.int64) for name, one in pixel.items()}
    return ReflectanceField(LampPlaces(names, place), numbers, transport, store.facts)


@dataclass(frozen=True)
class Relit:
    """A light field in another light."""

    field: LightField  # with other colours, in memory; its rays stay in the file
    lamps: PointLights  # that it is lit by
    points: bool  # whether these shine alike in all directions
    exposure: float  # by which light was multiplied to be shown, 1 as white


def relit(source: LightField, reflectance: ReflectanceField, light: Environment) -> Relit:
    """The light field as its lamps show it together, with the brightest of it white.

    InputError: the reflectance field is not of this light field.
    """
    lamps = light.on_lamps(reflectance.lamps.place)
    lit = {name: reflectance.lit(name, lamps.colour) for name in reflectance.pixel}
    peak = np.concatenate([values.max(axis=1, initial=0) for values in lit.values()])
    white = float(np.percentile(peak, EXPOSED)) if len(peak) else 0.0
    exposure = 1 / white if white > 0 else 1.0
    frames = {}
    for name, frame in source.frames.items():
        pixels = frame.camera.height_px * frame.camera.width_px
        if name not in lit or reflectance.pixel[name].max(initial=0) >= pixels:
            raise InputError(f"the reflectance field is not of this light field: {AGAIN}")
        shown = to_bytes(255 * exposure * lit[name])
        frames[name] = frame.coloured(reflectance.pixel[name], shown)
    points = reflectance.facts.get("light", "points") == "points"
    return Relit(replace(source, frames=frames), lamps, points, exposure)


def lit_scene(scene: Scene, lights: PointLights, exposure: float) -> Scene:
    """The object in the light of lamps, as bright as an exposure shows it."""
    return replace(scene, lamps=PointLights(lights.place, exposure * lights.colour))


@dataclass(frozen=True)
class SeenSpots:
    """Points of the object that a camera's rays see."""

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
    """Write the file into the folder of a capture, a picture of each lamp; return what is in it.

    `thrown`: lamps are mirrors by name, that throw the light of projectors. InputError: the file
    does not fit on the disk.
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
    mirrors = [MirrorId(one[0], int(one[1:]) - 1) for one in lamps.name if thrown]
    throwing = projectors(source, mirrors) if thrown else []

    def light(lamp: int, spots: Spots) -> Floats:
        if not thrown:
            return received_light(scene.embree, spots, lamps.place[lamp])
        return np.asarray(sum(one.light(scene.embree, spots) for one in throwing[lamp]))

    with h5py.File(folder / NAME, "w", libver=("v110", "v110")) as store:
        store.attrs["schema"], store.attrs["facts"] = SCHEMA, json.dumps(facts)
        group = store.create_group("lamps")  # by name and create_dataset: without times
        group.create_dataset("place", data=lamps.place)
        group.create_dataset("name", data=np.array(lamps.name, dtype="S"))
        for name, one in seen.items():
            _write_camera(store.create_group(name), one, light, lamps, progress)
    return facts


def seen_spots(frame: CameraFrame, scene: Scene) -> SeenSpots:
    """Points of the object that the captured rays of a camera see."""

    def band(rows: range) -> SeenSpots:
        part = frame.read(slice(rows.start, rows.stop))
        pixel = np.flatnonzero(part["mirror"]) + rows.start * frame.camera.width_px
        known = part["mirror"] > 0
        rays = (part[name][known].astype(np.float64) for name in ("origin", "direction"))
        hits = surface_hits(scene, *rays)
        subject = scene.subject
        return SeenSpots(pixel[hits.rows], hits.spots(subject), hits.albedo(subject))

    parts = in_threads(band, row_bands(frame.camera.height_px))
    names = ("pixel", "spots.place", "spots.normal", "spots.facet_normal", "albedo")
    pixel, *places, albedo = (np.concatenate(list(map(attrgetter(one), parts))) for one in names)
    return SeenSpots(pixel, Spots(*places), albedo)


def _write_camera(
    group: h5py.Group, seen: SeenSpots, light: Light, lamps: LampPlaces, progress: Progress
) -> None:
    """Write a picture for each lamp, as HDF5 would, but compress in several threads."""
    count, rays = len(lamps.name), len(seen.pixel)
    stored = create_rays(group, "transport", "f2", seen.pixel, count)
    items = [(k, part) for k in range(count) for part in chunks(rays, stored.chunks[1])]

    def packed(item: tuple[int, slice]) -> bytes:
        k, part = item
        received = light(k, seen.spots.part(part))[:, None]
        values = np.asarray(seen.albedo[part] * received, dtype=np.float32)
        return filtered_chunk(values.astype("<f2")[None], stored.chunks)

    def begin(item: tuple[int, slice]) -> None:
        progress(f"camera {group.name[1:]}, lamp {lamps.name[item[0]]}")

    for (k, part), data in zip(items, in_batches(packed, items, begin), strict=True):
        stored.id.write_direct_chunk((k, part.start, 0), data)
