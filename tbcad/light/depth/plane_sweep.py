"""The depth at each ray of a view, by a plane sweep (R. T. Collins, CVPR 1996).

A point on a target ray is on the object where the virtual cameras nearby show it in one colour. So
planes across the view are tried from the back of the capture sphere to its front; on each, every
pixel is looked up in the pictures of the nearest virtual cameras, and the plane where their
colours differ least, summed over a window, is taken.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter, uniform_filter

from tbcad.common.compiled import compiled_loop
from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.pictures import PinholePictures
from tbcad.light.simulate.parallel import chunks, first_then_threads
from tbcad.light.simulate.scene.rays import view_directions
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

CAMERAS = 16
# Pixels along the sides of blocks that are looked up in the same virtual cameras.
BLOCK_PX = 4
# Cameras that see something else in front are left out: this share, with the best colours, counts,
# and no colour (sum of three channels) counts as more different than that.
SHARE, MOST_DIFFERENT = 0.7, 60.0
# The colour that others are compared with is the mean of so many cameras, nearest to the ray.
REFERENCE = 3
ROWS_PER_CHUNK = 8


class Sweep(NamedTuple):
    """How fine a sweep is. docs/depth.md has what other numbers give."""

    step_px: int  # pixels of a view for one of its depth
    planes: int  # that are tried
    window_px: int  # over which differences are averaged, pixels of the depth


# Mirrors show a tenth of a view's resolution at most.
FINE = Sweep(4, 64, 5)
# A tenth of the time, for views that have to be quick.
QUICK = Sweep(8, 32, 3)


class FacingCameras(NamedTuple):
    """Virtual cameras on the side of a view."""

    number: Ints  # (k,)
    # along the view's axes and weighted: a target ray to image point (x, y), at unit distance, is
    # at least |(px - pz x, py - pz y)| from all rays of a camera with place p, mm, as root mean
    # square over the depth of the capture sphere (`two_plane`), (k, 3)
    place: Floats
    # from points (right, down, forward, 1) of the view into their pictures, homogeneous: column and
    # row, of which whole numbers are pixel centres, (k, 3, 4)
    matrix: Floats


def facing_cameras(pictures: PinholePictures, view: Camera) -> FacingCameras:
    """The virtual cameras on the side of a view; the others see the back of the object."""
    scale, plane = pictures.capture_mm / 2 / np.sqrt(3), -float(view.pinhole @ view.forward)
    place = (pictures.centre - view.pinhole) @ view.axes.T
    depth = place[:, 2] - plane
    some = np.flatnonzero(depth < 0)
    place = place[some] / np.sqrt(1 + (depth[some, None] / scale) ** 2)
    lens = np.zeros((len(some), 3, 3))
    lens[:, 0, 0] = lens[:, 1, 1] = pictures.focal_px[some]
    lens[:, :2, 2], lens[:, 2, 2] = (pictures.mask.shape[1] - 1) / 2, 1.0
    into = lens @ pictures.axes[some]
    offset = into @ (view.pinhole - pictures.centre[some])[..., None]
    return FacingCameras(some, place, np.concatenate([into @ view.axes.T, offset], axis=2))


def swept_depth(
    pictures: PinholePictures, view: Camera, sweep: Sweep = FINE
) -> tuple[Floats, Floats]:
    """Depth of the pixels of a view that looks at the origin, and its confidence.

    Depth (h, w), mm behind the plane through the origin that faces the view; NaN where rays pass
    the capture sphere, or are seen by fewer than REFERENCE cameras. And by how much colours differ
    more on a middling plane than on that one (h, w), 0 to MOST_DIFFERENT.
    """
    radius = pictures.capture_mm / 2
    planes = np.linspace(-radius, radius, sweep.planes)
    inside = _inside(view, planes, radius)
    difference = np.full(inside.shape, np.float32(np.nan))
    cameras = facing_cameras(pictures, view)
    known = pictures.picture, pictures.mask
    distance = planes - float(view.pinhole @ view.forward)

    def compare(rows: slice) -> None:
        ends = rows.start, rows.stop
        _compare_rows(cameras, known, distance, view.pixel_pitch, inside, difference, ends)

    first_then_threads(compare, chunks(view.height_px, ROWS_PER_CHUNK))
    compared = np.isfinite(difference)
    for plane, counted in zip(difference, compared, strict=True):
        _average(plane, counted, sweep.window_px)
    depth = median_filter(_lowest(difference, planes), sweep.window_px)
    confidence = np.where(
        compared.any(axis=0), _median(difference, compared) - difference.min(axis=0), 0.0
    )
    return np.where(compared.any(axis=0), depth, np.nan), confidence


def _average(plane: Colours, compared: Bools, window_px: int) -> None:
    """Replace the differences of a plane (h, w) by their means over the window."""
    share = np.maximum(uniform_filter(compared.astype(np.float32), window_px), 1e-6)
    mean = uniform_filter(np.where(compared, plane, 0), window_px) / share
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
    # |pinhole + t along|^2 <= radius^2
    squared, mixed = (along**2).sum(axis=2), along @ view.pinhole
    t = distance[:, None, None]
    return np.asarray(t * (t * squared + 2 * mixed) <= radius**2 - view.pinhole @ view.pinhole)


@compiled_loop
def _compare_rows(
    cameras: FacingCameras,
    pictures: tuple[Bytes, Bools],
    distance: Floats,
    pitch: float,
    inside: Bools,
    difference: Colours,
    rows: tuple[int, int],
) -> None:
    """Fill in differences (d, h, w) of some rows, the first that of a block, where `inside`.

    `pictures` (m, s, s, 3) and where they are known; `distance` (d,) of planes along the view, mm.
    """
    _, height, width = inside.shape
    for top in range(rows[0], rows[1], BLOCK_PX):
        for left in range(0, width, BLOCK_PX):
            part = inside[:, top : min(top + BLOCK_PX, rows[1]), left : left + BLOCK_PX]
            if not part.any():
                continue
            column, row = left - (width - 1) / 2, top - (height - 1) / 2
            half = (BLOCK_PX - 1) / 2
            x, y = (column + half) * pitch, (row + half) * pitch
            near = nearest_cameras(cameras.place, x, y, CAMERAS)
            _compare(
                cameras.matrix[near],
                cameras.number[near],
                distance,
                np.array([column, row, pitch]),
                part,
                difference[:, top : min(top + BLOCK_PX, rows[1]), left : left + BLOCK_PX],
                pictures[0],
                pictures[1],
            )


@compiled_loop
def nearest_cameras(place: Floats, x: float, y: float, most: int) -> Ints:
    """So many of some cameras, at weighted places (k, 3), the nearest to a target ray first."""
    kept, squared = np.empty(most, dtype=np.int64), np.empty(most)
    count = 0
    for k in range(len(place)):
        across, down = place[k, 0] - place[k, 2] * x, place[k, 1] - place[k, 2] * y
        one = across * across + down * down
        if count == most and one >= squared[-1]:
            continue
        j = min(count, most - 1)
        count = min(count + 1, most)
        while j > 0 and squared[j - 1] > one:
            kept[j], squared[j] = kept[j - 1], squared[j - 1]
            j -= 1
        kept[j], squared[j] = k, one
    return kept[:count]


@compiled_loop
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

    The nearest camera is first; `lens` is column and row of the block's first pixel from the
    middle, and the pixels' pitch. All else is as of `_compare_rows`.
    """
    planes, rows, columns = inside.shape
    colours, apart = np.empty((planes, len(cameras), 3)), np.empty(len(cameras))
    count = np.empty(planes, dtype=np.int64)
    for i in range(rows):
        for j in range(columns):
            x, y = (lens[0] + j) * lens[2], (lens[1] + i) * lens[2]
            count[:] = 0
            for c in range(len(cameras)):
                _look_along(
                    matrix, c, (x, y), distance, inside[:, i, j], picture[cameras[c]],
                    mask[cameras[c]], (colours, count),
                )  # fmt: skip
            for p in range(planes):
                if inside[p, i, j] and count[p] >= REFERENCE:
                    difference[p, i, j] = _difference(colours, p, count[p], apart)


@compiled_loop
def _look_along(
    matrix: Floats,
    c: int,
    ray: tuple[float, float],
    distance: Floats,
    inside: Bools,
    picture: Bytes,
    mask: Bools,
    found: tuple[Floats, Ints],
) -> None:
    """Add one camera's colours of a ray's points on all planes, where all of four pixels are known.

    Numbers instead of parts of arrays, also below: numba counts who uses an array, which takes
    longer than the colours.

    Of the camera: matrices and its place among them, picture (s, s, 3) and where it is known;
    `ray` is across, across, at unit distance. Colours (d, c, 3) and their numbers (d,) are added.
    """
    colours, count = found
    last = mask.shape[0] - 1
    away = matrix[c, 2, 0] * ray[0] + matrix[c, 2, 1] * ray[1] + matrix[c, 2, 2]
    across = matrix[c, 0, 0] * ray[0] + matrix[c, 0, 1] * ray[1] + matrix[c, 0, 2]
    down = matrix[c, 1, 0] * ray[0] + matrix[c, 1, 1] * ray[1] + matrix[c, 1, 2]
    for p in range(len(distance)):
        if not inside[p]:
            continue
        z = distance[p]
        scale = 1 / (away * z + matrix[c, 2, 3])
        column, row = (across * z + matrix[c, 0, 3]) * scale, (down * z + matrix[c, 1, 3]) * scale
        if not (0 <= column < last and 0 <= row < last):
            continue
        i, j = int(row), int(column)
        if not (mask[i, j] and mask[i, j + 1] and mask[i + 1, j] and mask[i + 1, j + 1]):
            continue
        lower, right = row - i, column - j
        for k in range(3):
            above = (1 - right) * picture[i, j, k] + right * picture[i, j + 1, k]
            below = (1 - right) * picture[i + 1, j, k] + right * picture[i + 1, j + 1, k]
            colours[p, count[p], k] = (1 - lower) * above + lower * below
        count[p] += 1


@compiled_loop
def _difference(colours: Floats, p: int, count: int, apart: Floats) -> float:
    """Mean difference of a plane's colours from the first ones, of those that differ least."""
    red = green = blue = 0.0
    for c in range(REFERENCE):
        red += colours[p, c, 0] / REFERENCE
        green += colours[p, c, 1] / REFERENCE
        blue += colours[p, c, 2] / REFERENCE
    for c in range(count):
        one = abs(colours[p, c, 0] - red) + abs(colours[p, c, 1] - green)
        one += abs(colours[p, c, 2] - blue)
        place = c
        while place > 0 and apart[place - 1] > one:
            apart[place] = apart[place - 1]
            place -= 1
        apart[place] = one
    counted = max(REFERENCE, int(SHARE * count))
    total = 0.0
    for c in range(counted):
        total += min(apart[c], MOST_DIFFERENT)
    return total / counted


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
