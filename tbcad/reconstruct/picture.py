"""What a camera would see of a field."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from tbcad.optics.camera import Camera
from tbcad.reconstruct.field import Field
from tbcad.reconstruct.fit import medium_of
from tbcad.reconstruct.marching import Medium, Singles, composited
from tbcad.reconstruct.rays import LEAST_CHORD_MM, entries
from tbcad.simulate.parallel import THREADS, chunks
from tbcad.simulate.scene.viewpoint import view_directions
from tbcad.types import Bytes, Floats

STRIDE = 0.3  # distances of nodes between samples
RAYS_PER_CHUNK = 1 << 13


@dataclass(frozen=True)
class FieldPicture:
    """A view of a field.

    Attributes:
        image: red, green, blue on the black background, (h, w, 3).
        opacity: 0 to 1, (h, w).
        distance: along each pixel's ray from the pinhole to where it becomes half opaque, mm,
            (h, w); NaN where it does not.
    """

    image: Bytes
    opacity: Singles
    distance: Floats


def field_picture(made: Field, view: Camera, stride: float = STRIDE) -> FieldPicture:
    """The picture that a pinhole camera would see.

    Args:
        made: the field.
        view: the camera, outside of the capture sphere.
        stride: between samples, in distances of nodes.
    """
    direction = view_directions(view).reshape(-1, 3)
    origin = np.broadcast_to(view.pinhole, direction.shape)
    entry, length = entries(origin, direction, made.grid.width_mm / 2)
    seen = np.flatnonzero(length > LEAST_CHORD_MM)
    found = np.zeros((len(direction), 5), dtype=np.float32)
    found[:, 4] = np.nan
    found[seen] = _in_threads(
        entry[seen], direction[seen].astype(np.float32), length[seen], medium_of(made, stride)
    )
    shape = (view.height_px, view.width_px)
    before = np.linalg.norm(entry - view.pinhole, axis=1)
    image = np.rint(255 * np.clip(found[:, :3], 0, 1)).astype(np.uint8)
    return FieldPicture(
        image.reshape(*shape, 3),
        found[:, 3].reshape(shape),
        (before + found[:, 4]).reshape(shape),
    )


def _in_threads(entry: Singles, direction: Singles, length: Singles, medium: Medium) -> Singles:
    parts = chunks(len(length), RAYS_PER_CHUNK)
    composited(entry[:0], direction[:0], length[:0], medium)  # compiled before any thread
    with ThreadPoolExecutor(THREADS) as pool:
        found = pool.map(lambda at: composited(entry[at], direction[at], length[at], medium), parts)
        return np.concatenate([np.zeros((0, 5), dtype=np.float32), *found])
