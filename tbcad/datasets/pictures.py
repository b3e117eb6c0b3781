"""The pictures of all virtual cameras: of a dataset, and in memory for views."""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.datasets.crops import Crop, MirrorId, chosen_mirrors, read_crop, reading_order
from tbcad.datasets.resampling import places, resampled
from tbcad.datasets.virtual_cameras import VirtualCameras, virtual_cameras
from tbcad.errors import InputError
from tbcad.geometry.vectors import norm
from tbcad.optics.camera import Camera
from tbcad.simulate.capture.light_field import LightField
from tbcad.simulate.parallel import in_batches
from tbcad.simulate.scene.ray_casting import Scene, cast_rays
from tbcad.types import Bools, Bytes, Floats, Ints, Progress

# Nine of ten virtual cameras lose nothing in pictures as fine as the finest tenth of them.
FINEST = 10  # percent
MOST_BYTES = 4 << 30
MOST_VIEW_BYTES, BYTES_PER_PIXEL = 1 << 30, 4  # of all pictures with their masks


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


@dataclass(frozen=True)
class PinholePictures:
    """Pictures of m virtual cameras that look at the origin.

    Attributes:
        centre: of the pinholes, mm, (m, 3).
        axes: rows: along the rows, down the columns, forward, (m, 3, 3).
        focal_px: (m,).
        picture: (m, s, s, 3).
        mask: where it is known, (m, s, s).
        capture_mm: diameter of the capture sphere.
    """

    centre: Floats
    axes: Floats
    focal_px: Floats
    picture: Bytes
    mask: Bools
    capture_mm: float


def pinhole_pictures(source: LightField, progress: Progress = lambda _: None) -> PinholePictures:
    """The pictures of all virtual cameras of a light field."""
    virtual = virtual_cameras(source, chosen_mirrors(source, None, 1), progress)
    taken = taken_pictures(source, virtual, _size(virtual, source.capture_mm), None, progress)
    axes = np.array([one.axes for one in taken.cameras]).reshape(-1, 3, 3)
    focal = np.array([1 / one.pixel_pitch for one in taken.cameras])
    return PinholePictures(
        virtual.centre, axes, focal, taken.picture, taken.mask, source.capture_mm
    )


def _size(virtual: VirtualCameras, capture_mm: float) -> int:
    """Width and height of the pictures, smaller where they would take too much memory."""
    if not len(virtual):
        return 1
    most = math.isqrt(MOST_VIEW_BYTES // (BYTES_PER_PIXEL * len(virtual)))
    return min(default_size(virtual, capture_mm), most)


def facing(pictures: PinholePictures, view: Camera) -> tuple[Ints, Floats]:
    """Virtual cameras on the side of a view (k,), and their places along its axes, (k, 3).

    The places are weighted: a target ray to image point (x, y), at unit distance, is at least
    |(px - pz x, py - pz y)| from all rays of a camera with place p, mm, as root mean square over
    the depth of the capture sphere (`two_plane`).
    """
    scale, plane = pictures.capture_mm / 2 / np.sqrt(3), -float(view.pinhole @ view.forward)
    place = (pictures.centre - view.pinhole) @ view.axes.T
    depth = place[:, 2] - plane
    near = np.flatnonzero(depth < 0)  # the others see the back of the object
    return near, place[near] / np.sqrt(1 + (depth[near, None] / scale) ** 2)


def projections(pictures: PinholePictures, view: Camera, some: Ints) -> Floats:
    """Matrices (k, 3, 4) from points (right, down, forward, 1) of a view into some pictures.

    The result is homogeneous: column and row, of which whole numbers are pixel centres.
    """
    lens = np.zeros((len(some), 3, 3))
    lens[:, 0, 0] = lens[:, 1, 1] = pictures.focal_px[some]
    lens[:, :2, 2], lens[:, 2, 2] = (pictures.mask.shape[1] - 1) / 2, 1.0
    into = lens @ pictures.axes[some]
    offset = into @ (view.pinhole - pictures.centre[some])[..., None]
    return np.concatenate([into @ view.axes.T, offset], axis=2)
