"""Many photographs of an object that moves, as one file: the rays stay, only colours change.

One HDF5 file beside the light field's (docs/light-field.md), whose rays it is about:

    a/pixel    (r,)       uint32  row * width + column of the rays that meet the capture sphere
    a/colour   (t, r, 3)  uint8   red, green, blue in each frame; and the same for b
"""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.cad.formats.hdf5 import StoredGroup, open_hdf5
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.simulate.capture.files import create_rays, filtered_chunk
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.parallel import chunks, in_threads
from tbcad.light.simulate.scene.ray_casting import Scene, both_sides, built_in_shade, colours_along
from tbcad.light.simulate.scene.rays import meets_sphere
from tbcad.types import Bytes, Floats, Ints, Progress

NAME = "sequence.h5"
SCHEMA = "tbcad-sequence/1"
AGAIN = "capture again with --frames"
Found = TypeVar("Found")


@dataclass(frozen=True)
class SequenceWriter:
    """A sequence that is being written."""

    pixel: Mapping[str, Ints]  # of each camera, numbers of the rays that are kept, (r,)
    colour: Mapping[str, h5py.Dataset]  # of each camera, the frames so far, (t, r, 3)

    def append(self, colours: Mapping[str, Bytes]) -> None:
        """Add a frame: of each camera the colours of the rays that are kept, (r, 3)."""
        places = [
            (name, part)
            for name, stored in self.colour.items()
            for part in chunks(stored.shape[1], stored.chunks[1])
        ]

        def packed(place: tuple[str, slice]) -> bytes:
            name, part = place
            return filtered_chunk(colours[name][part][None], self.colour[name].chunks)

        data = in_threads(packed, places)
        for stored in self.colour.values():
            stored.resize(len(stored) + 1, axis=0)
        for (name, part), values in zip(places, data, strict=True):
            stored = self.colour[name]
            stored.id.write_direct_chunk((len(stored) - 1, part.start, 0), values)


@contextmanager
def create_sequence(
    folder: Path, source: LightField, facts: Mapping[str, Any]
) -> Iterator[SequenceWriter]:
    """Create the file of a sequence in the folder of a capture."""
    radius = source.capture_mm / 2
    with h5py.File(folder / NAME, "w", libver=("v110", "v110")) as store:
        store.attrs["schema"], store.attrs["facts"] = SCHEMA, json.dumps(dict(facts))
        pixel, colour = {}, {}
        for name, frame in source.frames.items():
            pixel[name] = kept_pixels(frame, radius)
            group = store.create_group(name)
            colour[name] = create_rays(group, "colour", "u1", pixel[name], None)
        yield SequenceWriter(pixel, colour)


def kept_pixels(frame: CameraFrame, radius: float) -> Ints:
    """Numbers (r,) of the pixels whose rays meet the capture sphere, ascending."""
    planes = frame.read(slice(None))
    origin, direction = (
        planes[name].reshape(-1, 3).astype(np.float64) for name in ("origin", "direction")
    )
    return np.flatnonzero(meets_sphere(origin, direction, radius) & (planes["mirror"].ravel() > 0))


def sequence_frame(source: LightField, folder: Path, number: int) -> LightField:
    """The light field of one frame, from 0, of a capture's sequence, its colours in memory.

    InputError: there is no sequence or no such frame, or the file is damaged.
    """
    read = partial(_frames, source=source, number=number)
    with _opened(folder, read) as frames:
        return replace(source, frames=frames)


def frame_count(folder: Path) -> int:
    """Number of frames of the sequence of a capture.

    InputError: there is no sequence, or the file is damaged.
    """

    def count(store: StoredGroup) -> int:
        groups = [store.group(name) for name in ("a", "b") if name in store]
        return min(len(group.array("colour")) for group in groups)

    with _opened(folder, count) as found:
        return found


def _opened(folder: Path, read: Callable[[StoredGroup], Found]) -> AbstractContextManager[Found]:
    file = folder / NAME
    if not file.is_file():
        raise InputError(f"{file}: no such file, so there is one frame only: {AGAIN}")
    return open_hdf5(file, SCHEMA, "sequence", AGAIN, read)


def _frames(store: StoredGroup, source: LightField, number: int) -> dict[str, CameraFrame]:
    groups = {name: store.group(name) for name in source.frames}
    pixel = {name: group.array("pixel") for name, group in groups.items()}
    colour = {name: group.array("colour") for name, group in groups.items()}
    count = min(map(len, colour.values()))
    if not 0 <= number < count:
        raise InputError(f"--frame {number} is not in the sequence: allowed is 0 to {count - 1}")
    return {
        name: frame.coloured(pixel[name][:], colour[name][number])
        for name, frame in source.frames.items()
    }


def turns(count: int, whole: float) -> Floats:
    """Angles (count,) of frames, radians: the first is 0, the last one step before the whole."""
    return np.asarray(whole * np.arange(count) / count)


def write_turning(
    folder: Path, source: LightField, scene: Scene, angles: Floats, progress: Progress
) -> dict[str, Any]:
    """Write a sequence of the object at angles about z (t,), radians, and return what is in it.

    It goes to the folder of a capture, whose light field is `source`; the light is the built-in
    one.
    """
    facts = {"frames": len(angles), "turns_deg": np.degrees(angles).tolist()}
    with create_sequence(folder, source, facts) as writer:
        rays = {
            name: [
                np.asarray(frame.planes[key][:]).reshape(-1, 3)[writer.pixel[name]].astype(float)
                for key in ("origin", "direction")
            ]
            for name, frame in source.frames.items()
        }
        for k, angle in enumerate(angles.tolist()):
            progress(f"frame {k + 1} of {len(angles)}")
            turned, back = lit_when_turned(scene, angle), _about_z(-angle)
            writer.append(
                {name: to_bytes(colours_along(turned, origin @ back.T, direction @ back.T))
                 for name, (origin, direction) in rays.items()}
            )  # fmt: skip
    return facts


def turned_frame(folder: Path, number: int, scene: Scene, camera: Camera) -> tuple[Scene, Camera]:
    """Object and camera as they are to each other in a frame, with the light of that frame.

    InputError: the sequence does not say how far the object turned.
    """
    with open_hdf5(folder / NAME, SCHEMA, "sequence", AGAIN, lambda store: store.facts) as facts:
        turned: Any = facts.get("turns_deg")
    try:
        angle = float(np.radians(turned[number]))
    except (TypeError, LookupError) as error:
        raise InputError(f"{folder / NAME} says nothing of frame {number}: {AGAIN}") from error
    places = ("pinhole", "forward", "right")
    back = {name: _about_z(-angle) @ getattr(camera, name) for name in places}
    return lit_when_turned(scene, angle), replace(camera, **back)


def _about_z(angle: float) -> Floats:
    return np.asarray(Rotation.from_euler("z", angle).as_matrix())


def lit_when_turned(scene: Scene, angle: float) -> Scene:
    """The object before its turn, with the light that it has after it."""
    normals = scene.subject.normals @ _about_z(angle).T
    return replace(scene, shade=both_sides(built_in_shade, normals))
