"""Views while the viewpoint moves: each pixel from the nearest virtual camera, taken as a pinhole.

The nearest captured ray is nearly the nearest virtual camera's ray through the point where the
target ray meets the plane through the origin that faces the view. With the pictures of all virtual
cameras at hand (docs/datasets.md), a pixel costs a comparison with each camera nearby and one look
at a picture, and no search among rays.
"""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.datasets.crops import chosen_mirrors
from tbcad.datasets.pictures import default_size, taken_pictures
from tbcad.datasets.virtual_cameras import VirtualCameras, virtual_cameras
from tbcad.optics.camera import Camera
from tbcad.simulate.capture.light_field import LightField
from tbcad.simulate.parallel import compiled, in_threads
from tbcad.types import Bools, Bytes, Floats, Ints, Progress

# Pixels along the sides of a region, and of the blocks in it whose pixels share a list of cameras.
REGION_PX, BLOCK_PX = 64, 16
MOST_BYTES, BYTES_PER_PIXEL = 1 << 30, 4  # of all pictures with their masks


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
    most = math.isqrt(MOST_BYTES // (BYTES_PER_PIXEL * len(virtual)))
    return min(default_size(virtual, capture_mm), most)


def moving_view(pictures: PinholePictures, view: Camera, limits: tuple[float, ...]) -> Bytes:
    """The picture (h, w, 3) that a pinhole camera would see; black where nothing is near.

    Args:
        pictures: of all virtual cameras.
        view: the camera, which looks at the origin.
        limits: how far rays may be from target rays, root mean square over the depth of the
            capture sphere, mm: the second where nothing is as near as the first, and so on.
    """
    image = np.zeros((view.height_px, view.width_px, 3), dtype=np.uint8)
    cameras = _seen_from(pictures, view)
    place, radius = view.axes @ view.pinhole, pictures.capture_mm / 2
    lens = np.array([view.pixel_pitch, *place, place @ place - radius**2])

    def fill(corner: tuple[int, int]) -> None:
        for limit in limits:
            if _fill_region(image, corner, lens, limit, cameras, pictures.picture, pictures.mask):
                break

    corners = [
        (y, x)
        for y in range(0, view.height_px, REGION_PX)
        for x in range(0, view.width_px, REGION_PX)
    ]
    in_threads(fill, corners)
    return image


def _seen_from(pictures: PinholePictures, view: Camera) -> Floats:
    """Virtual cameras on the side of a view, (k, 13).

    Of each the number; its place along the view's axes, over which its rays are as far from target
    rays, mm, as root mean square over the capture sphere's depth (`two_plane`); and the place in
    its picture of image point (x, y), homogeneous: at (0, 0), and what x and y add to it.
    """
    scale, plane = pictures.capture_mm / 2 / np.sqrt(3), -float(view.pinhole @ view.forward)
    place = (pictures.centre - view.pinhole) @ view.axes.T
    depth = place[:, 2] - plane
    near = np.flatnonzero(depth < 0)  # the others see the back of the object
    weighted = place[near] / np.sqrt(1 + (depth[near, None] / scale) ** 2)
    across = plane * view.axes
    middle = view.pinhole + across[2] - pictures.centre[near]
    size = pictures.mask.shape[1]
    lens = np.zeros((len(near), 3, 3))
    lens[:, 0, 0] = lens[:, 1, 1] = pictures.focal_px[near]
    lens[:, :2, 2], lens[:, 2, 2] = (size - 1) / 2, 1.0  # whole numbers are pixel centres
    into = lens @ pictures.axes[near]
    points = [into @ across[0], into @ across[1]]
    first = (into @ middle[..., None])[..., 0]
    return np.column_stack([near, weighted, first, *points])


@compiled
def _fill_region(
    image: Bytes,
    corner: tuple[int, int],
    lens: Floats,
    limit: float,
    cameras: Floats,
    picture: Bytes,
    mask: Bools,
) -> bool:
    """Fill a region's pixels as far as virtual cameras are near; whether that is all of them.

    Args:
        image: (h, w, 3).
        corner: first row and column.
        lens: pixel pitch; the pinhole along right, down, forward; its power to the sphere.
        limit: how far rays may be from target rays, mm.
        cameras: as `_seen_from`, (k, 13).
        picture: (m, s, s, 3).
        mask: (m, s, s).
    """
    height, width, _ = image.shape
    bottom, right = min(corner[0] + REGION_PX, height), min(corner[1] + REGION_PX, width)
    every, _ = _near_box(cameras, np.arange(len(cameras)), corner, REGION_PX, lens, limit, image)
    complete = True
    for top in range(corner[0], bottom, BLOCK_PX):
        for left in range(corner[1], right, BLOCK_PX):
            some, bound = _near_box(cameras, every, (top, left), BLOCK_PX, lens, limit, image)
            order = np.argsort(bound)
            some, bound = some[order], bound[order]
            for row in range(top, min(top + BLOCK_PX, bottom)):
                y = (row - (height - 1) / 2) * lens[0]
                for column in range(left, min(left + BLOCK_PX, right)):
                    x = (column - (width - 1) / 2) * lens[0]
                    along = x * lens[1] + y * lens[2] + lens[3]
                    if along * along < lens[4] * (1 + x * x + y * y):
                        continue  # passes the capture sphere
                    k, i, j = _nearest(cameras, some, bound, x, y, limit, mask)
                    if k < 0:
                        complete = False
                        continue
                    _interpolate(image, row, column, picture, mask, k, i, j)
    return complete


@compiled
def _near_box(
    cameras: Floats,
    some: Ints,
    corner: tuple[int, int],
    size: int,
    lens: Floats,
    limit: float,
    image: Bytes,
) -> tuple[Ints, Floats]:
    """Those of some cameras within the limit of a square of pixels, and at least how far, mm."""
    half = size / 2 * lens[0]
    y = (corner[0] - (image.shape[0] - 1) / 2) * lens[0] + half
    x = (corner[1] - (image.shape[1] - 1) / 2) * lens[0] + half
    kept, bound = np.empty(len(some), dtype=np.int64), np.empty(len(some))
    count = 0
    for k in some:
        wx, wy, wz = cameras[k, 1], cameras[k, 2], cameras[k, 3]
        distance = np.sqrt((wx - wz * x) ** 2 + (wy - wz * y) ** 2)
        least = distance - abs(wz) * half * np.sqrt(2)
        if least <= limit:
            kept[count], bound[count] = k, least
            count += 1
    return kept[:count], bound[:count]


@compiled
def _nearest(
    cameras: Floats, some: Ints, bound: Floats, x: float, y: float, limit: float, mask: Bools
) -> tuple[int, float, float]:
    """Number of the nearest camera that shows (x, y), and row and column there; -1 for none."""
    best, number, row, column = limit * limit, -1, 0.0, 0.0
    for rank in range(len(some)):
        if bound[rank] > 0 and bound[rank] * bound[rank] > best:
            break
        c = cameras[some[rank]]
        across, down = c[1] - c[3] * x, c[2] - c[3] * y
        squared = across * across + down * down
        if squared > best:
            continue
        depth = c[6] + x * c[9] + y * c[12]
        j = (c[4] + x * c[7] + y * c[10]) / depth
        i = (c[5] + x * c[8] + y * c[11]) / depth
        k, size = int(c[0]), mask.shape[1]
        if -0.5 < i < size - 0.5 and -0.5 < j < size - 0.5 and mask[k, int(i + 0.5), int(j + 0.5)]:
            best, number, row, column = squared, k, i, j
    return number, row, column


@compiled
def _interpolate(
    image: Bytes, row: int, column: int, picture: Bytes, mask: Bools, k: int, i: float, j: float
) -> None:
    """Set a pixel from the four round place (i, j) of picture k, or from the nearest at the rim."""
    top, left = int(np.floor(i)), int(np.floor(j))
    down, across = i - top, j - left
    inside = 0 <= top < mask.shape[1] - 1 and 0 <= left < mask.shape[1] - 1
    if (
        inside
        and mask[k, top, left]
        and mask[k, top, left + 1]
        and (mask[k, top + 1, left] and mask[k, top + 1, left + 1])
    ):
        for channel in range(3):
            upper = (1 - across) * picture[k, top, left, channel] + (
                across * picture[k, top, left + 1, channel]
            )
            lower = (1 - across) * picture[k, top + 1, left, channel] + (
                across * picture[k, top + 1, left + 1, channel]
            )
            image[row, column, channel] = int((1 - down) * upper + down * lower + 0.5)
    else:
        for channel in range(3):
            image[row, column, channel] = picture[k, int(i + 0.5), int(j + 0.5), channel]
