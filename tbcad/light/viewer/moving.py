"""Views while the viewpoint moves: each pixel from the nearest virtual camera, taken as a pinhole.

The nearest captured ray is nearly the nearest virtual camera's ray through the point where the
target ray meets the plane through the origin that faces the view. With the pictures of all virtual
cameras at hand (docs/datasets.md), a pixel costs a comparison with each camera nearby and one look
at a picture, and no search among rays.
"""

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.pictures import PinholePictures
from tbcad.light.depth.plane_sweep import FacingCameras, facing_cameras, nearest_cameras
from tbcad.light.simulate.parallel import chunks, first_then_threads
from tbcad.types import Bools, Bytes, Floats

# Pixels along the sides of blocks that are looked up in the same virtual cameras; so many of them.
BLOCK_PX, CAMERAS = 8, 16
ROWS_PER_CHUNK = 4 * BLOCK_PX


def moving_view(pictures: PinholePictures, view: Camera) -> Bytes:
    """The picture (h, w, 3) that a pinhole camera would see; black where nothing shows it.

    The camera looks at the origin.
    """
    image = np.zeros((view.height_px, view.width_px, 3), dtype=np.uint8)
    cameras = facing_cameras(pictures, view)
    place, radius = view.axes @ view.pinhole, pictures.capture_mm / 2
    lens = np.array([view.pixel_pitch, *place, place @ place - radius**2])

    def fill(rows: slice) -> None:
        _fill_rows(image, (rows.start, rows.stop), lens, cameras, pictures.picture, pictures.mask)

    first_then_threads(fill, chunks(view.height_px, ROWS_PER_CHUNK))
    return image


@compiled_loop
def _fill_rows(
    image: Bytes,
    rows: tuple[int, int],
    lens: Floats,
    cameras: FacingCameras,
    picture: Bytes,
    mask: Bools,
) -> None:
    """Fill some rows, the first that of a block.

    `lens`: pixel pitch; the pinhole along right, down, forward; its power to the sphere. `picture`
    (m, s, s, 3) and `mask` (m, s, s) are those of all cameras.
    """
    height, width, _ = image.shape
    pitch, half = lens[0], (BLOCK_PX - 1) / 2
    for top in range(rows[0], rows[1], BLOCK_PX):
        for left in range(0, width, BLOCK_PX):
            x, y = left + half - (width - 1) / 2, top + half - (height - 1) / 2
            near = nearest_cameras(cameras.place, x * pitch, y * pitch, CAMERAS)
            for row in range(top, min(top + BLOCK_PX, rows[1])):
                y = (row - (height - 1) / 2) * pitch
                for column in range(left, min(left + BLOCK_PX, width)):
                    x = (column - (width - 1) / 2) * pitch
                    along = x * lens[1] + y * lens[2] + lens[3]
                    if along * along < lens[4] * (1 + x * x + y * y):
                        continue  # passes the capture sphere
                    best, k, i, j = np.inf, -1, 0.0, 0.0
                    for c in near:
                        across = cameras.place[c, 0] - cameras.place[c, 2] * x
                        down = cameras.place[c, 1] - cameras.place[c, 2] * y
                        squared = across * across + down * down
                        if squared < best:
                            there = _place_in_picture(cameras.matrix, c, x, y, -lens[3])
                            if _known(mask, cameras.number[c], *there):
                                best, k, i, j = squared, cameras.number[c], *there
                    if k >= 0:
                        _interpolate(image, row, column, picture, k, i, j)


@compiled_loop
def _place_in_picture(
    matrix: Floats, c: int, x: float, y: float, plane: float
) -> tuple[float, float]:
    """Row and column in a camera's picture of image point (x, y), at a distance, mm."""
    away = matrix[c, 2, 0] * x + matrix[c, 2, 1] * y + matrix[c, 2, 2]
    across = matrix[c, 0, 0] * x + matrix[c, 0, 1] * y + matrix[c, 0, 2]
    down = matrix[c, 1, 0] * x + matrix[c, 1, 1] * y + matrix[c, 1, 2]
    scale = 1 / (away * plane + matrix[c, 2, 3])
    return (down * plane + matrix[c, 1, 3]) * scale, (across * plane + matrix[c, 0, 3]) * scale


@compiled_loop
def _known(mask: Bools, k: int, i: float, j: float) -> bool:
    """Whether the four pixels round a row and column of picture k are known."""
    last = mask.shape[1] - 1
    if not (0 <= i < last and 0 <= j < last):
        return False
    top, left = int(i), int(j)
    return bool(
        mask[k, top, left]
        and mask[k, top, left + 1]
        and mask[k, top + 1, left]
        and mask[k, top + 1, left + 1]
    )


@compiled_loop
def _interpolate(
    image: Bytes, row: int, column: int, picture: Bytes, k: int, i: float, j: float
) -> None:
    """Set a pixel from the four round a row and column of picture k."""
    top, left = int(i), int(j)
    down, across = i - top, j - left
    for channel in range(3):
        upper = (1 - across) * picture[k, top, left, channel]
        upper += across * picture[k, top, left + 1, channel]
        lower = (1 - across) * picture[k, top + 1, left, channel]
        lower += across * picture[k, top + 1, left + 1, channel]
        image[row, column, channel] = int((1 - down) * upper + down * lower + 0.5)
