"""The pictures of all virtual cameras: of a dataset, and in memory for views."""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.common.compiled import compiled
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.datasets.virtual_cameras import (
    Crop,
    FittedCameras,
    MirrorId,
    at_middle,
    chosen_mirrors,
    neighbour_steps,
    read_crop,
    reading_order,
    virtual_cameras,
)
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.parallel import in_batches
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays
from tbcad.light.simulate.scene.rays import meets_sphere, unit_directions
from tbcad.types import Bools, Bytes, Colours, Floats, Ints, Progress

MOST_SAMPLES = 8
# A sample on the edge of two triangles belongs to both but for rounding.
ROUNDING = 1e-9
# Nine of ten virtual cameras lose nothing in pictures as fine as the finest tenth of them.
FINEST = 10  # percent
MOST_BYTES = 4 << 30
MOST_VIEW_BYTES, BYTES_PER_PIXEL = 1 << 30, 4  # of all pictures with their masks


def places(crop: Crop, camera: Camera) -> Floats:
    """Column and row in the picture of each ray of a crop, (h, w, 2); whole numbers are centres."""
    points = at_middle(crop.origin, crop.direction, camera.forward)
    return camera.project(points)


def resampled(crop: Crop, camera: Camera, radius: float) -> tuple[Bytes, Bools]:
    """The picture of a pinhole camera, square, from the rays of a crop.

    Picture (h, w, 3), black where nothing is known, and its mask (h, w): pixels inside the cell
    whose rays meet the capture sphere of this radius, mm.
    """
    place = places(crop, camera)
    samples = _samples(place, crop.meets)
    size = camera.width_px * samples
    total, hit = np.zeros((size, size, 3), dtype=np.float32), np.zeros((size, size), dtype=np.bool_)
    _fill((place + 0.5) * samples - 0.5, crop.colour, crop.valid, total, hit)
    blocks = (camera.height_px, samples, camera.width_px, samples)
    picture = total.reshape(*blocks, 3).mean(axis=(1, 3))
    mask = hit.reshape(blocks).all(axis=(1, 3)) & _sees_sphere(camera, radius)
    return np.where(mask[..., None], np.rint(picture), 0).astype(np.uint8), mask


def _sees_sphere(camera: Camera, radius: float) -> Bools:
    direction = unit_directions(camera, range(camera.height_px)).reshape(-1, 3)
    origin = np.broadcast_to(camera.pinhole, direction.shape)
    meets = meets_sphere(np.ascontiguousarray(origin), direction, radius)
    return meets.reshape(camera.height_px, camera.width_px)


def _samples(place: Floats, known: Bools) -> int:
    """Samples across a pixel, one at least for each ray."""
    across, down = neighbour_steps(place, known)
    if not len(across):
        return 1
    area = np.abs(across[:, 0] * down[:, 1] - across[:, 1] * down[:, 0])
    return int(np.clip(np.ceil(1 / np.sqrt(np.median(area))), 1, MOST_SAMPLES))


@compiled
def _fill(place: Floats, colour: Bytes, valid: Bools, total: Colours, hit: Bools) -> None:
    """Interpolate colours in the triangles of neighbouring rays.

    Of four rays in a square, the triangle without ray k is filled: two triangles where all four
    are valid, one where one is missing.
    """
    square, corners = np.empty((4, 2), dtype=np.int64), np.empty((3, 2), dtype=np.int64)
    for y in range(place.shape[0] - 1):
        for x in range(place.shape[1] - 1):
            count = 0
            for k in range(4):
                square[k, 0], square[k, 1] = y + (k >= 2), x + (k == 1 or k == 2)  # noqa: PLR1714
                count += valid[square[k, 0], square[k, 1]]
            for k in range(4):
                missing = not valid[square[k, 0], square[k, 1]]
                if (count == 4 and k % 2 == 1) or (count == 3 and missing):
                    for j in range(3):
                        at = (k + 1 + j) % 4
                        corners[j, 0], corners[j, 1] = square[at, 0], square[at, 1]
                    _fill_triangle(place, colour, corners, total, hit)


@compiled
def _fill_triangle(place: Floats, colour: Bytes, corners: Ints, total: Colours, hit: Bools) -> None:
    """Fill the samples between three rays, whose rows and columns are in corners (3, 2)."""
    first = place[corners[0, 0], corners[0, 1]]
    second = place[corners[1, 0], corners[1, 1]]
    third = place[corners[2, 0], corners[2, 1]]
    ax, ay = first[0], first[1]
    bx, by, cx, cy = second[0] - ax, second[1] - ay, third[0] - ax, third[1] - ay
    area = bx * cy - by * cx
    if area == 0:
        return
    low_x, high_x = ax + min(0.0, bx, cx), ax + max(0.0, bx, cx)
    low_y, high_y = ay + min(0.0, by, cy), ay + max(0.0, by, cy)
    for y in range(max(int(np.ceil(low_y)), 0), min(int(np.floor(high_y)) + 1, hit.shape[0])):
        for x in range(max(int(np.ceil(low_x)), 0), min(int(np.floor(high_x)) + 1, hit.shape[1])):
            b = ((x - ax) * cy - (y - ay) * cx) / area
            c = (bx * (y - ay) - by * (x - ax)) / area
            if b < -ROUNDING or c < -ROUNDING or b + c > 1 + ROUNDING:
                continue
            hit[y, x] = True
            for channel in range(3):
                total[y, x, channel] = (
                    (1 - b - c) * colour[corners[0, 0], corners[0, 1], channel]
                    + b * colour[corners[1, 0], corners[1, 1], channel]
                    + c * colour[corners[2, 0], corners[2, 1], channel]
                )


@dataclass(frozen=True)
class PinholePictures:
    """Pictures of m virtual cameras that look at the origin, of one size."""

    centre: Floats  # of the pinholes, mm, (m, 3)
    axes: Floats  # rows: along the rows, down the columns, forward, (m, 3, 3)
    focal_px: Floats  # (m,)
    picture: Bytes  # (m, s, s, 3)
    mask: Bools  # where it is known, (m, s, s)
    capture_mm: float  # diameter of the capture sphere


def default_size(virtual: FittedCameras, capture_mm: float) -> int:
    """An even number of pixels, as fine as the finest tenth of the virtual cameras."""
    return 2 * int(np.ceil(capture_mm / np.percentile(virtual.pitch_mm, FINEST) / 2))


def taken_pictures(
    source: LightField,
    virtual: FittedCameras,
    size_px: int,
    scene: Scene | None,
    progress: Progress = lambda _: None,
) -> tuple[PinholePictures, Floats]:
    """Resample the crops of all virtual cameras, to pictures of `size_px` x `size_px` pixels.

    Also distances of each ray's place from where its point of the object appears through the
    pinhole, pixels, of all rays that hit the object, (n,); none without it. InputError: so many
    pictures of this size do not fit into memory.
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
    errors = in_batches(take, order, lambda k: progress(virtual.mirrors[k].name))
    off = np.concatenate([np.zeros(0), *errors])
    axes = np.array([one.axes for one in cameras]).reshape(-1, 3, 3)
    focal = np.array([1 / one.pixel_pitch for one in cameras])
    return PinholePictures(virtual.centre, axes, focal, picture, mask, source.capture_mm), off


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


def pinhole_pictures(source: LightField, progress: Progress = lambda _: None) -> PinholePictures:
    """The pictures of all virtual cameras of a light field."""
    virtual = virtual_cameras(source, chosen_mirrors(source, None, 1), progress)
    return taken_pictures(source, virtual, _size(virtual, source.capture_mm), None, progress)[0]


def _size(virtual: FittedCameras, capture_mm: float) -> int:
    """Width and height of the pictures, smaller where they would take too much memory."""
    if not len(virtual):
        return 1
    most = math.isqrt(MOST_VIEW_BYTES // (BYTES_PER_PIXEL * len(virtual)))
    return min(default_size(virtual, capture_mm), most)
