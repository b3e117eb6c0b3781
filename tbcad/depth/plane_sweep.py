"""The depth at each ray of a view, by a plane sweep (R. T. Collins, CVPR 1996).

A point on a target ray is on the object where the virtual cameras nearby show it in one colour. So
planes across the view are tried from the back of the capture sphere to its front; on each, every
pixel is looked up in the pictures of the nearest virtual cameras, and the plane where their
colours differ least, summed over a window, is taken.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter, uniform_filter

from tbcad.datasets.pinhole_pictures import PinholePictures, facing, projections
from tbcad.optics.camera import Camera
from tbcad.simulate.parallel import chunks, compiled, first_then_threads
from tbcad.simulate.scene.viewpoint import view_directions
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

# docs/depth.md has what other numbers give.
PLANES = 64
CAMERAS = 16
WINDOW_PX = 5
# Pixels along the sides of blocks that are looked up in the same virtual cameras.
BLOCK_PX = 4
# Cameras that see something else in front are left out: this share, with the best colours, counts,
# and no colour (sum of three channels) counts as more different than that.
SHARE, MOST_DIFFERENT = 0.7, 60.0
# The colour that others are compared with is the mean of so many cameras, nearest to the ray.
REFERENCE = 3
ROWS_PER_CHUNK = 8


class _Cameras(NamedTuple):
    """Virtual cameras on the side of a view: numbers (k,), places (k, 3), matrices (k, 3, 4)."""

    number: Ints
    place: Floats
    matrix: Floats


def _seen_from(pictures: PinholePictures, view: Camera) -> _Cameras:
    number, place = facing(pictures, view)
    return _Cameras(number, place, projections(pictures, view, number))


def swept_depth(pictures: PinholePictures, view: Camera) -> tuple[Floats, Floats]:
    """Depth of a view's pixels, and its confidence.

    Args:
        pictures: of all virtual cameras.
        view: a camera that looks at the origin.

    Returns:
        Depth (h, w), mm behind the plane through the origin that faces the view; NaN where rays
        pass the capture sphere, or are seen by fewer than REFERENCE cameras. And by how much
        colours differ more on a middling plane than on that one (h, w), 0 to MOST_DIFFERENT.
    """
    radius = pictures.capture_mm / 2
    planes = np.linspace(-radius, radius, PLANES)
    inside = _inside(view, planes, radius)
    difference = np.full(inside.shape, np.float32(np.nan))
    cameras = _seen_from(pictures, view)
    rows = chunks(view.height_px, ROWS_PER_CHUNK)
    middle = len(rows) // 2  # there rays meet the capture sphere, so the loop is compiled
    first_then_threads(
        partial(_compare_rows, pictures, cameras, view, planes, inside, difference),
        [*rows[middle:], *rows[:middle]],
    )
    compared = np.isfinite(difference)
    for plane, counted in zip(difference, compared, strict=True):
        _average(plane, counted)
    depth = median_filter(_lowest(difference, planes), WINDOW_PX)
    confidence = np.where(
        compared.any(axis=0), _median(difference, compared) - difference.min(axis=0), 0.0
    )
    return np.where(compared.any(axis=0), depth, np.nan), confidence


def _average(plane: Colours, compared: Bools) -> None:
    """Replace the differences of a plane (h, w) by their means over the window."""
    share = np.maximum(uniform_filter(compared.astype(np.float32), WINDOW_PX), 1e-6)
    mean = uniform_filter(np.where(compared, plane, 0), WINDOW_PX) / share
    plane[...] = np.where(compared, mean, MOST_DIFFERENT)


def _median(difference: Colours, compared: Bools) -> Floats:
    """Median (h, w) of differences (d, h, w) on the planes where there are any."""
    ordered = np.sort(np.where(compared, difference, np.inf), axis=0)
    middle = np.maximum(compared.sum(axis=0) - 1, 0) // 2
    return np.asarray(np.take_along_axis(ordered, middle[None], axis=0)[0], dtype=np.float64)


def _inside(view: Camera, planes: Floats, radius: float) -> Bools:
    """Whether pixels' rays are in the capture sphere on each plane, (d, h, w)."""
    along = view_directions(view)
    along /= (along @ view.forward)[..., None]
    distance = planes - view.pinhole @ view.forward
    points = view.pinhole + distance[:, None, None, None] * along
    return np.asarray(np.linalg.norm(points, axis=3) <= radius)


def _compare_rows(
    pictures: PinholePictures,
    cameras: _Cameras,
    view: Camera,
    planes: Floats,
    inside: Bools,
    difference: Colours,
    rows: slice,
) -> None:
    """Fill in the differences (d, h, w) of some rows, whose first is the first of a block."""
    distance = planes - float(view.pinhole @ view.forward)
    half = np.array([view.width_px - 1, view.height_px - 1]) / 2
    for top in range(rows.start, min(rows.stop, view.height_px), BLOCK_PX):
        for left in range(0, view.width_px, BLOCK_PX):
            block = np.s_[:, top : top + BLOCK_PX, left : left + BLOCK_PX]
            if not inside[block].any():
                continue
            first = np.array([left, top]) - half
            middle = (first + (BLOCK_PX - 1) / 2) * view.pixel_pitch
            across = cameras.place[:, :2] - cameras.place[:, 2:] * middle
            order = np.argsort((across**2).sum(axis=1))[:CAMERAS]
            _compare(
                cameras.matrix[order],
                cameras.number[order],
                distance,
                np.array([*first, view.pixel_pitch]),
                inside[block],
                difference[block],
                pictures.picture,
                pictures.mask,
            )


@compiled
def _compare(
    matrix: Floats,
    cameras: Ints,
    distance: Floats,
    lens: Floats,
    inside: Bools,
    difference: Colours,
    picture: Bytes,
    mask: Bools,
) -> None:
    """Fill in the differences of a block, (d, b, b), from cameras (c,) by their matrices (c, 3, 4).

    Args:
        matrix: into the cameras' pictures.
        cameras: their numbers, the nearest first.
        distance: of the planes along the view from its pinhole, mm, (d,).
        lens: column and row of the block's first pixel from the middle, and the pixels' pitch.
        inside: where to compare, (d, b, b).
        difference: is filled.
        picture: of all cameras, (m, s, s, 3).
        mask: where they are known, (m, s, s).
    """
    colours, apart = np.empty((len(cameras), 3)), np.empty(len(cameras))
    for p in range(inside.shape[0]):
        for i in range(inside.shape[1]):
            for j in range(inside.shape[2]):
                if not inside[p, i, j]:
                    continue
                x, y = (lens[0] + j) * lens[2] * distance[p], (lens[1] + i) * lens[2] * distance[p]
                count = 0
                for c in range(len(cameras)):
                    if _look_up(
                        matrix[c], x, y, distance[p], picture[cameras[c]], mask[cameras[c]],
                        colours[count],
                    ):  # fmt: skip
                        count += 1
                if count >= REFERENCE:
                    difference[p, i, j] = _difference(colours[:count], apart[:count])


@compiled
def _look_up(
    matrix: Floats, x: float, y: float, z: float, picture: Bytes, mask: Bools, colour: Floats
) -> bool:
    """Fill in the colour of a point between four pixels of a picture; whether all are known."""
    depth = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3]
    column = (matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]) / depth
    row = (matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]) / depth
    last = mask.shape[0] - 1
    if not (0 <= column < last and 0 <= row < last):
        return False
    i, j = int(row), int(column)
    if not (mask[i, j] and mask[i, j + 1] and mask[i + 1, j] and mask[i + 1, j + 1]):
        return False
    down, right = row - i, column - j
    for k in range(3):
        above = (1 - right) * picture[i, j, k] + right * picture[i, j + 1, k]
        below = (1 - right) * picture[i + 1, j, k] + right * picture[i + 1, j + 1, k]
        colour[k] = (1 - down) * above + down * below
    return True


@compiled
def _difference(colours: Floats, apart: Floats) -> float:
    """Mean difference of colours (c, 3) from the first ones, of those that differ least."""
    for c in range(len(colours)):
        apart[c] = 0.0
        for k in range(3):
            reference = 0.0
            for first in range(REFERENCE):
                reference += colours[first, k] / REFERENCE
            apart[c] += abs(colours[c, k] - reference)
    apart.sort()
    count = max(REFERENCE, int(SHARE * len(colours)))
    total = 0.0
    for c in range(count):
        total += min(apart[c], MOST_DIFFERENT)
    return total / count


def _lowest(difference: Colours, planes: Floats) -> Floats:
    """Depth (h, w) where differences (d, h, w) are lowest, between planes by a parabola."""
    lowest = difference.argmin(axis=0)
    middle = np.clip(lowest, 1, len(planes) - 2)
    before, at, after = (
        np.take_along_axis(difference, middle[None] + step, axis=0)[0].astype(np.float64)
        for step in (-1, 0, 1)
    )
    bend = before - 2 * at + after
    safe = np.where(bend > 0, bend, 1.0)
    offset = np.where(bend > 0, np.clip((before - after) / 2 / safe, -0.5, 0.5), 0.0)
    steps = np.where(lowest == middle, middle + offset, lowest)
    return np.asarray(np.interp(steps, np.arange(len(planes)), planes))
