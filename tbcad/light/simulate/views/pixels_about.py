"""The pixels of one mirror about a point.

A view has many more pixels than a mirror, so the points of neighbouring targets lie within a pixel
or two of a mirror. There the rays change evenly from pixel to pixel: which four of them are round a
point follows from the rays of one pixel and its neighbours, without a search.
"""

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.types import Bytes, Floats

# Width of the bell curve that weights pixels. docs/decisions/0006: of 0.2 to 0.4 pixels the best
# in PSNR and SSIM.
SIGMA_PX = 0.2
# A pixel counts for nothing whose exponent is so much smaller than the nearest one's: 6e-6 of it.
LEAST_EXPONENT = 12.0


Point = tuple[float, float, float]
"""Across, across, mm, and along the direction of the view, over s."""
Sum = tuple[float, float, float, float]
"""Red, green, blue, each by its weight, and the weights."""
NOTHING = (0.0, 0.0, 0.0, 0.0)


@compiled_loop
def nearest_at(points: Floats, width: int, start: int, point: Point) -> int:
    """The pixel whose ray passes a point nearer than all its neighbours' do.

    By steps from pixel to pixel. Numbers instead of parts of arrays, here and below: numba counts
    who uses an array, which takes longer than the distances.

    Args:
        points: two-plane coordinates of captured rays, (p, 4); NaN where there is none.
        width: columns of the tile.
        start: where to begin.
        point: that is looked for.
    """
    pixel = start
    best = _squared(points, pixel, point)
    while True:
        nearer = pixel
        for row in (pixel - width, pixel, pixel + width):
            for other in (row - 1, row, row + 1):
                squared = _squared(points, other, point)
                if squared < best:  # never so for NaN
                    best, nearer = squared, other
        if nearer == pixel:
            return pixel
        pixel = nearer


@compiled_loop
def _squared(points: Floats, pixel: int, point: Point) -> float:
    across = points[pixel, 0] + point[2] * points[pixel, 2] - point[0]
    down = points[pixel, 1] + point[2] * points[pixel, 3] - point[1]
    result: float = across * across + down * down
    return result


@compiled_loop
def linearise(points: Floats, width: int, pixel: int, local: Floats, c: int) -> bool:
    """Fill in how rays change from pixel to pixel; whether there are rays on all sides.

    `local[c]`: the pixel's ray (4), and what a column and a row more add to it (4 each).
    """
    for row in (pixel - width, pixel, pixel + width):
        for other in (row - 1, row, row + 1):
            if np.isnan(points[other, 0]):
                return False
    for j in range(4):
        local[c, j] = points[pixel, j]
        local[c, 4 + j] = (points[pixel + 1, j] - points[pixel - 1, j]) / 2
        local[c, 8 + j] = (points[pixel + width, j] - points[pixel - width, j]) / 2
    return True


@compiled_loop
def sum_between(
    points: Floats,
    local: Floats,
    c: int,
    pixel: int,
    width: int,
    colour: Bytes,
    point: Point,
    limit: float,
) -> tuple[bool, Sum]:
    """The sum of the four pixels round a point, and whether they are beside the linearised one.

    Args:
        points: two-plane coordinates of captured rays, (p, 4).
        local: as `linearise`, (m, 12).
        c: its row.
        pixel: that is linearised.
        width: columns of the tile.
        colour: of all pixels, (p, 3).
        point: that they show.
        limit: how far from the point the nearest one's ray may pass, mm.
    """
    z = point[2]
    x = point[0] - local[c, 0] - z * local[c, 2]
    y = point[1] - local[c, 1] - z * local[c, 3]
    xu, yu = local[c, 4] + z * local[c, 6], local[c, 5] + z * local[c, 7]
    xv, yv = local[c, 8] + z * local[c, 10], local[c, 9] + z * local[c, 11]
    determinant = xu * yv - xv * yu
    u, v = (x * yv - y * xv) / determinant, (y * xu - x * yu) / determinant
    if not (abs(u) < 1 and abs(v) < 1):
        return False, NOTHING
    first = pixel + (0 if u > 0 else -1) + (0 if v > 0 else -width)
    s00, s10 = _squared(points, first, point), _squared(points, first + 1, point)
    s01, s11 = _squared(points, first + width, point), _squared(points, first + width + 1, point)
    least = min(s00, s10, s01, s11)
    if least > limit * limit:
        return True, NOTHING
    bell = 1 / (SIGMA_PX * SIGMA_PX * (xu * xu + yu * yu + xv * xv + yv * yv))
    most = least * bell + LEAST_EXPONENT
    red = green = blue = weight = 0.0
    for step, squared in ((0, s00), (1, s10), (width, s01), (width + 1, s11)):
        if squared * bell > most:
            continue
        share, other = np.exp(-squared * bell), first + step
        red += share * colour[other, 0]
        green += share * colour[other, 1]
        blue += share * colour[other, 2]
        weight += share
    return True, (red, green, blue, weight)


@compiled_loop
def sum_around(
    points: Floats, width: int, colour: Bytes, pixel: int, point: Point, limit: float
) -> Sum:
    """The sum of the nearest pixel and its neighbours, some of which have no ray."""
    if not _squared(points, pixel, point) <= limit * limit:
        return NOTHING
    bell_width2 = 2 * SIGMA_PX**2 * _squared_pitch(points, width, pixel, point[2])
    red = green = blue = weight = 0.0
    for row in (pixel - width, pixel, pixel + width):
        for other in (row - 1, row, row + 1):
            squared = _squared(points, other, point)
            if np.isnan(squared):
                continue
            share = np.exp(-squared / bell_width2)
            red += share * colour[other, 0]
            green += share * colour[other, 1]
            blue += share * colour[other, 2]
            weight += share
    return red, green, blue, weight


@compiled_loop
def _squared_pitch(points: Floats, width: int, pixel: int, z: float) -> float:
    """Mean squared distance of the rays of a pixel's four neighbours from its own, at a depth."""
    centre = points[pixel, 0] + z * points[pixel, 2], points[pixel, 1] + z * points[pixel, 3], z
    total, count = 0.0, 0
    for other in (pixel - 1, pixel + 1, pixel - width, pixel + width):
        squared = _squared(points, other, centre)
        if not np.isnan(squared):
            total += squared
            count += 1
    return total / count if count > 0 else 1.0
