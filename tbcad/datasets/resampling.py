"""Crops of mirrors as pictures of pinhole cameras: undistorted, of one size, right way round.

Each ray of a crop has a place in the picture. Neighbouring rays form triangles there, in which
colours are interpolated; a pixel is the mean of so many samples that no ray is skipped.
"""

import numpy as np

from tbcad.compiled import compiled
from tbcad.datasets.crops import Crop
from tbcad.datasets.virtual_cameras import at_middle
from tbcad.optics.camera import Camera
from tbcad.simulate.scene.rays import meets_sphere, unit_directions
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

MOST_SAMPLES = 8
# A sample on the edge of two triangles belongs to both but for rounding.
ROUNDING = 1e-9


def places(crop: Crop, camera: Camera) -> Floats:
    """Column and row in the picture of each ray of a crop, (h, w, 2); whole numbers are centres."""
    points = at_middle(crop.origin, crop.direction, camera.forward)
    return camera.project(points)


def resampled(crop: Crop, camera: Camera, radius: float) -> tuple[Bytes, Bools]:
    """The picture of a pinhole camera from the rays of a crop.

    Args:
        crop: pixels of a mirror.
        camera: stands for the mirror; square pictures.
        radius: of the capture sphere, mm.

    Returns:
        Picture (h, w, 3), black where nothing is known, and its mask (h, w): pixels inside the
        cell whose rays meet the capture sphere.
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
    inside = known[:-1, :-1] & known[:-1, 1:] & known[1:, :-1]
    if not inside.any():
        return 1
    across = (place[:-1, 1:] - place[:-1, :-1])[inside]
    down = (place[1:, :-1] - place[:-1, :-1])[inside]
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
                        corners[j] = square[(k + 1 + j) % 4]
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
