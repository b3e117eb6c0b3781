"""The pictures of all virtual cameras, and how far points of the object are off in them."""

from dataclasses import dataclass

import numpy as np

from tbcad.datasets.crops import Crop, MirrorId, read_crop, reading_order
from tbcad.datasets.resampling import places, resampled
from tbcad.datasets.virtual_cameras import VirtualCameras
from tbcad.errors import InputError
from tbcad.geometry.vectors import norm
from tbcad.optics.camera import Camera
from tbcad.simulate.capture.light_field import LightField
from tbcad.simulate.parallel import in_batches
from tbcad.simulate.scene.ray_casting import Scene, cast_rays
from tbcad.types import Bools, Bytes, Floats, Progress

# Nine of ten virtual cameras lose nothing in pictures as fine as the finest tenth of them.
FINEST = 10  # percent
MOST_BYTES = 4 << 30


@dataclass(frozen=True)
class Pictures:
    """Pictures of m pinhole cameras, of one size.

    Attributes:
        cameras: (m,).
        picture: (m, h, w, 3).
        mask: where it is known, (m, h, w).
        reprojection_px: distance of each ray's place from where its point of the object appears
            through the pinhole, of all rays that hit the object; None without the object.
    """

    cameras: list[Camera]
    picture: Bytes
    mask: Bools
    reprojection_px: Floats | None


def default_size(virtual: VirtualCameras, capture_mm: float) -> int:
    """An even number of pixels, as fine as the finest tenth of the virtual cameras."""
    return 2 * int(np.ceil(capture_mm / np.percentile(virtual.pitch_mm, FINEST) / 2))


def taken_pictures(
    source: LightField,
    virtual: VirtualCameras,
    size_px: int,
    scene: Scene | None,
    progress: Progress = lambda _: None,
) -> Pictures:
    """Resample the crops of all virtual cameras.

    Args:
        source: the light field.
        virtual: its virtual cameras, m of them.
        size_px: width and height of the pictures.
        scene: the object, where it is known.
        progress: called with each step.

    Raises:
        InputError: so many pictures of this size do not fit into memory.
    """
    cameras, radius = virtual.pinhole_cameras(source.capture_mm, size_px), source.capture_mm / 2
    if len(cameras) * size_px**2 * 4 > MOST_BYTES:
        raise InputError(
            f"{len(cameras)} pictures of {size_px} x {size_px} pixels are more than "
            f"{MOST_BYTES >> 30} GiB: choose a smaller --size, or fewer with --every"
        )
    picture = np.zeros((len(cameras), size_px, size_px, 3), dtype=np.uint8)
    mask = np.zeros(picture.shape[:3], dtype=np.bool_)

    def take(k: int) -> Floats:
        crop = crop_of(source, virtual.mirrors[k])
        picture[k], mask[k] = resampled(crop, cameras[k], radius)
        return np.zeros(0) if scene is None else reprojection_errors(crop, cameras[k], scene)

    order = reading_order(source, virtual.mirrors).tolist()
    errors = list(in_batches(take, order, lambda k: progress(virtual.mirrors[k].name)))
    return Pictures(cameras, picture, mask, None if scene is None else np.concatenate(errors))


def crop_of(source: LightField, mirror: MirrorId) -> Crop:
    """The pixels of a mirror that is known to have some."""
    crop = read_crop(source, mirror)
    if crop is None:
        raise InputError(f"{mirror.name} has lost its pixels: the light field changed meanwhile")
    return crop


def reprojection_errors(crop: Crop, camera: Camera, scene: Scene) -> Floats:
    """Pixels between the place of each ray and where the camera sees the point it hits, (n,)."""
    origin, direction = crop.rays
    depth = cast_rays(scene, origin, direction).depth
    hit = np.isfinite(depth)
    points = origin[hit] + depth[hit, None] * direction[hit]
    return norm(camera.project(points) - places(crop, camera)[crop.meets][hit])
