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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.formats.hdf5 import StoredGroup, open_hdf5
from tbcad.reflectance.lamp_places import LampPlaces
from tbcad.simulate.parallel import chunks, in_threads
from tbcad.types import Colours, Floats

NAME = "reflectance.h5"
SCHEMA = "tbcad-reflectance/1"
RAYS_PER_CHUNK = 1 << 15
LAMPS_AT_ONCE = 64
AGAIN = "capture again with --lights"


@dataclass(frozen=True)
class ReflectanceField:
    """A reflectance field in an open file.

    Attributes:
        lamps: (l,).
        pixel: of each camera, numbers of the rays that meet the object, (r,).
        transport: of each camera, (l, r, 3), read by slices.
        facts: how it was made.
    """

    lamps: LampPlaces
    pixel: Mapping[str, Any]
    transport: Mapping[str, Any]
    facts: dict[str, Any]

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
