"""The nearest captured ray to each target ray (section 4.2 of the paper).

tests/light/simulate/views/test_nearest.py compares with a four-dimensional k-d tree over all rays.
"""

import numpy as np

from tbcad.common.compiled import compiled
from tbcad.light.simulate.parallel import chunks, in_threads
from tbcad.light.simulate.views.ray_bundle import (
    RAYS_PER_CHUNK,
    RAYS_PER_RUN,
    RayBundle,
    boxes_around,
    mirrors_near_boxes,
)
from tbcad.types import Floats, Ints


def nearest_rays(bundle: RayBundle, targets: Floats) -> Ints:
    """Pixel (n,) of the bundle nearest to each target (n, 4); -1 beyond the bundle's limit.

    Any order of the targets gives the same pixels; neighbours one after the other take less time.
    """
    # That far a ray may pass the virtual pinhole, for each mm of its distance from the target.
    reach = np.sqrt(1 + bundle.pinholes[:, 2] ** 2)

    def pixels(part: slice) -> Ints:
        arrays = bundle.points, bundle.tiles, bundle.pinholes, reach
        return _nearest(*arrays, targets[part], bundle.limit)

    parts = in_threads(pixels, chunks(len(targets), RAYS_PER_CHUNK))
    return np.concatenate([np.zeros(0, dtype=np.int64), *parts])


@compiled
def _nearest(
    points: Floats, tiles: Ints, pinholes: Floats, reach: Floats, targets: Floats, limit: float
) -> Ints:
    boxes = boxes_around(targets, RAYS_PER_RUN)
    near_chunk = mirrors_near_boxes(pinholes, boxes, limit)
    near, previous = near_chunk, -1
    last = tiles[:, 3].copy()
    result = np.full(len(targets), -1, dtype=np.int64)
    for i in range(len(targets)):
        x, y, a, b = targets[i, 0], targets[i, 1], targets[i, 2], targets[i, 3]
        if i % RAYS_PER_RUN == 0:
            run = boxes[i // RAYS_PER_RUN : i // RAYS_PER_RUN + 1]
            near = near_chunk[mirrors_near_boxes(pinholes[near_chunk], run, limit)]
        best, owner = limit, -1
        for rank in range(-1, len(near)):  # first the mirror of the previous target
            k = previous if rank < 0 else near[rank]
            if k < 0 or (rank >= 0 and k == previous):
                continue
            depth = pinholes[k, 2]
            across, down = x + depth * a - pinholes[k, 0], y + depth * b - pinholes[k, 1]
            beyond = best * reach[k] + pinholes[k, 3]
            if across * across + down * down > beyond * beyond or last[k] < 0:
                continue
            # What is found is no bound for later targets: where the descent ends at the edge of a
            # mirror's pixels, the nearest may be much nearer.
            pixel, squared = _descend(points, tiles[k, 2], last[k], x, y, a, b)
            last[k] = pixel
            if squared < best * best:
                best, result[i], owner = np.sqrt(squared), pixel, k
        previous = owner
    return result


@compiled
def _descend(
    points: Floats, width: int, start: int, x: float, y: float, a: float, b: float
) -> tuple[int, float]:
    """The pixel nearer to (x, y, a, b) than all its neighbours, and its squared distance.

    By steps from pixel to pixel.

    Numbers instead of parts of arrays: numba counts who uses an array, which takes longer than
    the distances.
    """
    pixel = start
    best = _squared_distance(points, pixel, x, y, a, b)
    while True:
        nearer = pixel
        for row in (pixel - width, pixel, pixel + width):
            for other in (row - 1, row, row + 1):
                squared = _squared_distance(points, other, x, y, a, b)
                if squared < best:  # never so for NaN
                    best, nearer = squared, other
        if nearer == pixel:
            return pixel, best
        pixel = nearer


@compiled
def _squared_distance(points: Floats, pixel: int, x: float, y: float, a: float, b: float) -> float:
    across, down = points[pixel, 0] - x, points[pixel, 1] - y
    slope, steepness = points[pixel, 2] - a, points[pixel, 3] - b
    result: float = across * across + down * down + slope * slope + steepness * steepness
    return result
