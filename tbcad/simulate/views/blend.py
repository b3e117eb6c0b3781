"""A target ray from several virtual cameras: each shows the point where the ray meets a surface.

Those virtual cameras are used that look at the point most nearly along the target ray; their
weights fall to zero at the first one that is not used, so that pictures are continuous (C.
Buehler and others, Unstructured Lumigraph Rendering, 2001, section 3). Each adds the pixels
about the point, weighted by a bell curve much narrower than they are: the pixels of several
cameras lie between each other, and together they are finer than one of them.
"""

import numpy as np

from tbcad.simulate.parallel import chunks, compiled, in_threads
from tbcad.simulate.views.ray_bundle import (
    RAYS_PER_CHUNK,
    RAYS_PER_RUN,
    RayBundle,
    boxes_around,
    greedy_descent,
    mirrors_near_boxes,
    squared_distance,
)
from tbcad.types import Bools, Bytes, Floats, Ints

# docs/decisions/0006: of 3 to 10 cameras and 0.2 to 0.4 pixels the best in PSNR and SSIM for the
# time they take.
CAMERAS = 6
SIGMA_PX = 0.2


def blend_cameras(bundle: RayBundle, targets: Floats, depth: Floats) -> tuple[Floats, Bools]:
    """Colours of target rays, and which were seen.

    Args:
        bundle: captured rays; none is used that passes the point by more than the limit.
        targets: two-plane coordinates, (n, 4).
        depth: where each target meets the surface, along the direction of the view, over s, (n,).

    Returns:
        Colours (n, 3), 0 to 255, and whether any virtual camera showed the point, (n,).
    """

    def blended(part: slice) -> Floats:
        arrays = bundle.points, bundle.tiles, bundle.pinholes, bundle.colour
        return _blend(*arrays, targets[part], depth[part], bundle.limit)

    parts = in_threads(blended, chunks(len(targets), RAYS_PER_CHUNK))
    result = np.concatenate([np.zeros((0, 4)), *parts])
    return result[:, :3], result[:, 3] > 0


@compiled
def _blend(
    points: Floats,
    tiles: Ints,
    pinholes: Floats,
    colour: Bytes,
    targets: Floats,
    depth: Floats,
    limit: float,
) -> Floats:
    near = mirrors_near_boxes(pinholes, boxes_around(targets, RAYS_PER_RUN), limit)
    last = tiles[:, 3].copy()
    result = np.zeros((len(targets), 4))
    chosen, angle = np.empty(CAMERAS + 1, dtype=np.int64), np.empty(CAMERAS + 1)
    for i in range(len(targets)):
        ray, z = targets[i], depth[i]
        _choose(pinholes, near, last, ray, z, chosen, angle)
        for j in range(CAMERAS):
            k = chosen[j]
            weight = 1 - angle[j] / angle[CAMERAS]
            if k < 0 or weight <= 0:
                continue
            last[k] = greedy_descent(points, tiles[k], last[k], ray, z, 0.0)
            if squared_distance(points, last[k], ray, z, 0.0) <= limit**2:
                _add_pixels(points, tiles[k], colour, last[k], ray, z, weight, result[i])
        if result[i, 3] > 0:
            for c in range(3):
                result[i, c] /= result[i, 3]
    return result


@compiled
def _choose(
    pinholes: Floats,
    near: Ints,
    last: Ints,
    ray: Floats,
    depth: float,
    chosen: Ints,
    angle: Floats,
) -> None:
    """Fill in the mirrors that see the point most nearly along the ray, the best first."""
    chosen[:], angle[:] = -1, np.inf
    x, y = ray[0] + depth * ray[2], ray[1] + depth * ray[3]
    for k in near:
        ahead = depth - pinholes[k, 2]
        if last[k] < 0 or ahead <= 0:
            continue
        across = (x - pinholes[k, 0]) / ahead - ray[2]
        down = (y - pinholes[k, 1]) / ahead - ray[3]
        deviation = np.sqrt(across * across + down * down)
        if deviation >= angle[-1]:
            continue
        j = len(angle) - 1
        while j > 0 and angle[j - 1] > deviation:
            angle[j], chosen[j] = angle[j - 1], chosen[j - 1]
            j -= 1
        angle[j], chosen[j] = deviation, k


@compiled
def _add_pixels(
    points: Floats,
    tile: Ints,
    colour: Bytes,
    pixel: int,
    ray: Floats,
    depth: float,
    weight: float,
    total: Floats,
) -> None:
    """Add a pixel and its neighbours of one mirror to a total of colours and weights."""
    first, height, width = tile[0], tile[1], tile[2]
    row, column = divmod(pixel - first, width)
    bell_width2 = 2 * SIGMA_PX**2 * _squared_pitch(points, tile, pixel, depth)
    for y in range(max(row - 1, 0), min(row + 2, height)):
        for x in range(max(column - 1, 0), min(column + 2, width)):
            other = first + y * width + x
            distance2 = squared_distance(points, other, ray, depth, 0.0)
            if np.isnan(distance2):
                continue
            share = weight * np.exp(-distance2 / bell_width2)
            for c in range(3):
                total[c] += share * colour[other, c]
            total[3] += share


@compiled
def _squared_pitch(points: Floats, tile: Ints, pixel: int, depth: float) -> float:
    """Mean squared distance of the rays of a pixel's four neighbours from its own, at a depth."""
    first, height, width = tile[0], tile[1], tile[2]
    row, column = divmod(pixel - first, width)
    centre = points[pixel]
    total, count = 0.0, 0
    for step, there in (
        (-1, column > 0),
        (1, column + 1 < width),
        (-width, row > 0),
        (width, row + 1 < height),
    ):
        if there and not np.isnan(points[pixel + step, 0]):
            total += squared_distance(points, pixel + step, centre, depth, 0.0)
            count += 1
    return total / count if count > 0 else 1.0
