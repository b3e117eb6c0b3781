"""Views while the viewpoint moves: each pixel from the nearest virtual camera, taken as a pinhole.

The nearest captured ray is nearly the nearest virtual camera's ray through the point where the
target ray meets the plane through the origin that faces the view. With the pictures of all virtual
cameras at hand (docs/datasets.md), a pixel costs a comparison with each camera nearby and one look
at a picture, and no search among rays.
"""

import numpy as np

from tbcad.common.compiled import compiled
from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.pictures import PinholePictures, facing, projections
from tbcad.light.simulate.parallel import first_then_threads
from tbcad.types import Bools, Bytes, Floats, Ints

# Pixels along the sides of a region, and of the blocks in it whose pixels share a list of cameras.
REGION_PX, BLOCK_PX = 64, 16


def moving_view(pictures: PinholePictures, view: Camera, limits: tuple[float, ...]) -> Bytes:
    """The picture (h, w, 3) that a pinhole camera would see; black where nothing is near.

    The camera looks at the origin. `limits`: how far rays may be from target rays, root mean square
    over the depth of the capture sphere, mm: the second where nothing is as near as the first, and
    so on.
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
    first_then_threads(fill, corners)
    return image


def _seen_from(pictures: PinholePictures, view: Camera) -> Floats:
    """Virtual cameras on the side of a view, (k, 13).

    Of each the number, its weighted place (`facing`), and the place in its picture of image point
    (x, y) on the plane through the origin, homogeneous: at (0, 0), and what x and y add to it.
    """
    near, place = facing(pictures, view)
    matrix, plane = projections(pictures, view, near), -float(view.pinhole @ view.forward)
    first = plane * matrix[:, :, 2] + matrix[:, :, 3]
    return np.column_stack([near, place, first, plane * matrix[:, :, 0], plane * matrix[:, :, 1]])


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
    """Fill the pixels of a region from a corner as far as cameras (k, 13) are near; whether all.

    `lens`: pixel pitch; the pinhole along right, down, forward; its power to the sphere. `picture`
    (m, s, s, 3) and `mask` (m, s, s) are those of all cameras.
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
