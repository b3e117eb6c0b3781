"""An object that turns about z in a light that stands still."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.errors import InputError
from tbcad.formats.hdf5 import open_hdf5
from tbcad.optics.camera import Camera
from tbcad.simulate.capture.light_field import LightField
from tbcad.simulate.capture.photograph import to_bytes
from tbcad.simulate.capture.sequence import AGAIN, NAME, SCHEMA, SequenceWriter, create_sequence
from tbcad.simulate.parallel import chunks, in_threads
from tbcad.simulate.scene.ray_casting import Scene, both_sides, built_in_shade, cast_rays
from tbcad.types import Bytes, Floats, Progress

RAYS_PER_CHUNK = 1 << 16


def turns(count: int, whole: float) -> Floats:
    """Angles (count,) of frames, radians: the first is 0, the last one step before the whole."""
    return np.asarray(whole * np.arange(count) / count)


def write_turning(
    folder: Path, source: LightField, scene: Scene, angles: Floats, progress: Progress
) -> dict[str, Any]:
    """Write a sequence of the object at some angles, and return what is in it.

    Args:
        folder: of the capture.
        source: its light field.
        scene: the object, in the built-in light.
        angles: about z, radians, (t,).
        progress: called with each frame.
    """
    facts = {"frames": len(angles), "turns_deg": np.degrees(angles).tolist()}
    with create_sequence(folder, source, facts) as writer:
        rays = {name: _rays(source, writer, name) for name in source.frames}
        for k, angle in enumerate(angles.tolist()):
            progress(f"frame {k + 1} of {len(angles)}")
            turned, back = lit_when_turned(scene, angle), _about_z(-angle)
            writer.append(
                {name: _colours(turned, origin @ back.T, direction @ back.T)
                 for name, (origin, direction) in rays.items()}
            )  # fmt: skip
    return facts


def _rays(source: LightField, writer: SequenceWriter, name: str) -> tuple[Floats, Floats]:
    planes, pixel = source.frames[name].planes, writer.pixel[name]
    origin, direction = (
        np.asarray(planes[key][:]).reshape(-1, 3)[pixel].astype(np.float64)
        for key in ("origin", "direction")
    )
    return origin, direction


def _colours(scene: Scene, origin: Floats, direction: Floats) -> Bytes:
    """Colours (r, 3) along rays (r, 3)."""
    parts = chunks(len(origin), RAYS_PER_CHUNK)
    colours = in_threads(
        lambda part: to_bytes(cast_rays(scene, origin[part], direction[part]).colour), parts
    )
    return np.concatenate([np.zeros((0, 3), dtype=np.uint8), *colours])


def turn_of_frame(folder: Path, number: int) -> float:
    """The angle of a frame, radians.

    Raises:
        InputError: the sequence does not say how far the object turned.
    """
    with open_hdf5(folder / NAME, SCHEMA, "sequence", AGAIN, lambda store: store.facts) as facts:
        turned: Any = facts.get("turns_deg")
    try:
        return float(np.radians(turned[number]))
    except (TypeError, LookupError) as error:
        raise InputError(f"{folder / NAME} says nothing of frame {number}: {AGAIN}") from error


def _about_z(angle: float) -> Floats:
    return np.asarray(Rotation.from_euler("z", angle).as_matrix())


def lit_when_turned(scene: Scene, angle: float) -> Scene:
    """The object before its turn, with the light that it has after it."""
    normals = scene.subject.normals @ _about_z(angle).T
    return replace(scene, shade=both_sides(built_in_shade, normals))


def camera_before_turn(camera: Camera, angle: float) -> Camera:
    """The camera that sees the object before its turn as this one sees it after it."""
    back = _about_z(-angle)
    return replace(
        camera,
        pinhole=back @ camera.pinhole,
        forward=back @ camera.forward,
        right=back @ camera.right,
    )
