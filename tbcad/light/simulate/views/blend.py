"""A target ray from several virtual cameras: each shows the point where the ray meets a surface.

Those virtual cameras are used that look at the point most nearly along the target ray; their
weights fall to zero at the first one that is not used, so that pictures are continuous (C.
Buehler and others, Unstructured Lumigraph Rendering, 2001, section 3). Each adds the pixels
about the point, weighted by a bell curve much narrower than they are: the pixels of several
cameras lie between each other, and together they are finer than one of them.

A view has many more pixels than a mirror, so the points of neighbouring targets lie within a pixel
or two of a mirror. There the rays change evenly from pixel to pixel: which four of them are round a
point follows from the rays of one pixel and its neighbours, without a search.
"""

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.light.simulate.parallel import over_chunks
from tbcad.light.simulate.views.ray_bundle import (
    RAYS_PER_CHUNK,
    RAYS_PER_RUN,
    RayBundle,
    boxes_around,
    mirrors_near_boxes,
)
from tbcad.types import Bools, Bytes, Floats, Ints

# Width of the bell curve that weights pixels. docs/decisions/0006: of 0.2 to 0.4 pixels the best
# in PSNR and SSIM.
SIGMA_PX = 0.2
# A pixel counts for nothing whose exponent is so much smaller than the nearest one's: 6e-6 of it.
LEAST_EXPONENT = 12.0


Point = tuple[float, float, float]
"""Across, across, mm, and along the direction of the view, over s."""
Sum = tuple[float, float, float, float]  # red, green, blue, each by its weight, and the weights
NOTHING = (0.0, 0.0, 0.0, 0.0)
# docs/decisions/0006: of 3 to 10 the best in PSNR and SSIM for the time they take.
CAMERAS = 6


@compiled_loop
def nearest_at(points: Floats, width: int, start: int, point: Point) -> int:
    """The pixel whose ray passes a point nearer than all its neighbours' do, by steps from `start`.

    Rays are two-plane coordinates (p, 4), NaN where there is none. Numbers instead of parts of
    arrays, here and below: numba counts who uses an array, which takes longer than the distances.
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
    """The sum of the four pixels round a point, and whether they are beside the linearised `pixel`.

    `local[c]` is as `linearise` fills it in. Where the nearest one's ray passes by more than
    `limit`, mm, the sum is NOTHING.
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


def blend_cameras(bundle: RayBundle, targets: Floats, depth: Floats) -> tuple[Floats, Bools]:
    """Colours (n, 3), 0 to 255, of target rays, and whether any virtual camera showed the point.

    No ray of the bundle is used that passes the point by more than the limit. Any order of the
    targets (n, 4) gives the same colours but for rounding; neighbours one after the other take less
    time. `depth` (n,) is where each meets the surface, along the direction of the view, over s.
    """

    def blended(part: slice) -> Floats:
        arrays = bundle.points, bundle.tiles, bundle.pinholes, bundle.colour
        return _blend(*arrays, targets[part], depth[part], bundle.limit)

    result = over_chunks(blended, len(targets), RAYS_PER_CHUNK)
    return result[:, :3], result[:, 3] > 0


@compiled_loop
def _blend(
    points: Floats,
    tiles: Ints,
    pinholes: Floats,
    colour: Bytes,
    targets: Floats,
    depth: Floats,
    limit: float,
) -> Floats:
    """Colours and total weights of targets, (n, 4)."""
    boxes = boxes_around(targets, RAYS_PER_RUN)
    near_chunk = mirrors_near_boxes(pinholes, boxes, limit)
    near_chunk = near_chunk[tiles[near_chunk, 3] >= 0]
    last = tiles[:, 3].copy()
    result = np.zeros((len(targets), 4))
    chosen, angle2 = np.empty(CAMERAS + 1, dtype=np.int64), np.empty(CAMERAS + 1)
    local = np.empty((len(near_chunk), 12))
    for run in range(len(boxes)):
        stop = min((run + 1) * RAYS_PER_RUN, len(targets))
        near = _candidates(pinholes, near_chunk, boxes[run], depth[run * RAYS_PER_RUN : stop])
        even = np.zeros(len(near), dtype=np.bool_)  # whether `local` holds for a camera
        for i in range(run * RAYS_PER_RUN, stop):
            z, a, b = depth[i], targets[i, 2], targets[i, 3]
            point = targets[i, 0] + z * a, targets[i, 1] + z * b, z
            _choose(pinholes, near, point, a, b, chosen, angle2)
            for j in range(CAMERAS):
                c, weight = chosen[j], 1 - np.sqrt(angle2[j] / angle2[CAMERAS])
                if c < 0 or not weight > 0:
                    break  # so are all further ones
                k = near[c]
                width, known, more = tiles[k, 2], False, NOTHING
                if even[c]:
                    known, more = sum_between(
                        points, local, c, last[k], width, colour, point, limit
                    )
                if not known:
                    last[k] = nearest_at(points, width, last[k], point)
                    even[c] = linearise(points, width, last[k], local, c)
                    if even[c]:
                        known, more = sum_between(
                            points, local, c, last[k], width, colour, point, limit
                        )
                if not known:
                    more = sum_around(points, width, colour, last[k], point, limit)
                for channel in range(4):
                    result[i, channel] += weight * more[channel]
            if result[i, 3] > 0:
                for channel in range(3):
                    result[i, channel] /= result[i, 3]
    return result


@compiled_loop
def _candidates(pinholes: Floats, near: Ints, box: Floats, depth: Floats) -> Ints:
    """Those mirrors (c,) that targets in a box (2, 4) may be blended from, or weighted by."""
    low, high = depth.min(), depth.max()
    least, most = np.empty(len(near)), np.empty(len(near))
    for j in range(len(near)):
        k = near[j]
        z = pinholes[k, 2]
        x = abs(box[0, 0] + z * box[0, 2] - pinholes[k, 0])
        y = abs(box[0, 1] + z * box[0, 3] - pinholes[k, 1])
        half_x, half_y = box[1, 0] + abs(z) * box[1, 2], box[1, 1] + abs(z) * box[1, 3]
        if high <= z:
            least[j] = most[j] = np.inf
            continue
        least[j] = np.hypot(max(x - half_x, 0.0), max(y - half_y, 0.0)) / (high - z)
        most[j] = np.hypot(x + half_x, y + half_y) / (low - z) if low > z else np.inf
    worst, count, kept = _of_rank(most, CAMERAS), 0, np.empty(len(near), dtype=np.int64)
    for j in range(len(near)):
        if least[j] <= worst and least[j] < np.inf:
            kept[count] = near[j]
            count += 1
    return kept[:count]


@compiled_loop
def _of_rank(values: Floats, rank: int) -> float:
    """The value that so many others come before, infinite if there are too few.

    As `np.partition` has it, which takes numba six seconds to compile.
    """
    least = np.full(rank + 1, np.inf)
    for value in values:
        j = rank + 1
        while j > 0 and least[j - 1] > value:
            j -= 1
            if j < rank:
                least[j + 1] = least[j]
        if j <= rank:
            least[j] = value
    return float(least[rank])


@compiled_loop
def _choose(
    pinholes: Floats, near: Ints, point: Point, a: float, b: float, chosen: Ints, angle2: Floats
) -> None:
    """Fill in which of some mirrors see a point most nearly along slopes a and b, the best first.

    `chosen` are places in `near`, -1 where there are too few; `angle2` squared deviations, infinite
    there.
    """
    for j in range(len(chosen)):
        chosen[j], angle2[j] = -1, np.inf
    for c in range(len(near)):
        k = near[c]
        ahead = point[2] - pinholes[k, 2]
        if ahead <= 0:
            continue
        across = (point[0] - pinholes[k, 0]) / ahead - a
        down = (point[1] - pinholes[k, 1]) / ahead - b
        deviation = across * across + down * down
        j = len(angle2) - 1
        if deviation >= angle2[j]:
            continue
        while j > 0 and angle2[j - 1] > deviation:
            angle2[j], chosen[j] = angle2[j - 1], chosen[j - 1]
            j -= 1
        angle2[j], chosen[j] = deviation, c
