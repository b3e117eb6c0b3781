"""The reflectance field as a file: the light that each lamp sends along each captured ray.

One HDF5 file beside the light field's (docs/relighting.md), whose rays it is about:

    lamps/place      (l, 3)     float64  mm
    lamps/name       (l,)       text
    a/pixel          (r,)       uint32   row * width + column of the rays that meet the object
    a/transport      (l, r, 3)  float16  red, green, blue; and the same for b

A lamp gives 1 to a white surface at the origin that faces it. Light adds up, so the picture in any
light is the sum over the lamps of their colours times their transport.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.cad.formats.hdf5 import StoredGroup, open_hdf5
from tbcad.errors import InputError
from tbcad.light.reflectance.environment import Environment
from tbcad.light.reflectance.lamp_places import LampPlaces
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.parallel import chunks, in_threads
from tbcad.light.simulate.scene.point_lights import PointLights
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.types import Colours, Floats

NAME = "reflectance.h5"
SCHEMA = "tbcad-reflectance/1"
RAYS_PER_CHUNK = 1 << 15
LAMPS_AT_ONCE = 64
AGAIN = "capture again with --lights"
# Percentile of the light along rays that a photograph shows as white.
EXPOSED = 99.5
# Directions of the sky that the ground truth is lit from.
TRUE_LIGHTS = 512


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

        parts = in_threads(part, chunks(stored.shape[1], RAYS_PER_CHUNK))
        return np.concatenate([np.zeros((0, 3), dtype=np.float32), *parts])


@contextmanager
def open_reflectance(folder: Path) -> Iterator[ReflectanceField]:
    """Open the reflectance field of a capture for reading.

    Raises:
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

    Raises:
        InputError: the reflectance field is not of this light field.
    """
    lamps = light.on_lamps(reflectance.lamps.place)
    lit = {name: reflectance.lit(name, lamps.colour) for name in reflectance.pixel}
    peak = np.concatenate([values.max(axis=1, initial=0) for values in lit.values()])
    white = float(np.percentile(peak, EXPOSED)) if len(peak) else 0.0
    exposure = 1 / white if white > 0 else 1.0
    frames = {}
    for name, frame in source.frames.items():
        shape = (frame.camera.height_px, frame.camera.width_px)
        if name not in lit or reflectance.pixel[name].max(initial=0) >= shape[0] * shape[1]:
            raise InputError(f"the reflectance field is not of this light field: {AGAIN}")
        colour = _picture(255 * exposure * lit[name], reflectance.pixel[name], shape)
        frames[name] = replace(frame, planes={**frame.planes, "colour": colour})
    points = reflectance.facts.get("light", "points") == "points"
    return Relit(replace(source, frames=frames), lamps, points, exposure)


def _picture(colours: Colours, pixel: Any, shape: tuple[int, int]) -> Any:
    picture = np.zeros((shape[0] * shape[1], 3), dtype=np.uint8)
    picture[pixel] = to_bytes(colours)
    return picture.reshape(*shape, 3)


def lit_scene(scene: Scene, lights: PointLights, exposure: float) -> Scene:
    """The object in the light of lamps, as bright as an exposure shows it."""
    return replace(scene, lamps=PointLights(lights.place, exposure * lights.colour))
