"""A wanted ray from several virtual cameras: each shows the point where the ray meets a surface.

Of the virtual cameras those are taken that look at the point most nearly along the wanted ray;
their weights fall to nothing at the first that is left out, so that pictures are continuous (C.
Buehler and others, Unstructured Lumigraph Rendering, 2001, section 3). Each lends the pixels
about the point, by a bell curve much narrower than its pixels: the pixels of several cameras lie
between each other, and together they are finer than one of them.
"""

import numpy as np
from numpy.typing import NDArray

from tbcad.simulate.parallel import compiled, in_threads
from tbcad.simulate.views.ray_bundle import (
    SAMPLED_RAY_STEP,
    RayBundle,
    candidate_mirrors,
    greedy_descent,
    ray_chunks,
    squared_distance,
)
from tbcad.types import Bytes, Floats, Ints

# docs/decisions/0006: of 3 to 10 cameras and 0.2 to 0.4 pixels the best in PSNR and SSIM for the
# time they take.
CAMERAS = 6
SIGMA_PX = 0.2


def blend_cameras(
    sheaf: RayBundle, wanted: Floats, depth: Floats, limit: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Colours of wanted rays, and which were seen.

    Args:
        sheaf: captured rays.
        wanted: points of the slab, (n, 4).
        depth: where each wanted ray meets the surface, along the slab's direction, over s, (n,).
        limit: farthest that a captured ray may pass that point, mm.

    Returns:
        Colours (n, 3), 0 to 255, and whether any virtual camera showed the point, (n,).
    """

    def mixed(part: slice) -> Floats:
        arrays = sheaf.points, sheaf.tiles, sheaf.meeting, sheaf.colour
        return _blend(*arrays, wanted[part], depth[part], limit)

    result = np.concatenate([np.zeros((0, 4)), *in_threads(mixed, ray_chunks(len(wanted)))])
    return result[:, :3], result[:, 3] > 0


@compiled
def _blend(
    points: Floats,
    tiles: Ints,
    meeting: Floats,
    colour: Bytes,
    wanted: Floats,
    depth: Floats,
    limit: float,
) -> Floats:
    near = candidate_mirrors(meeting, wanted, limit, SAMPLED_RAY_STEP)
    last = tiles[:, 3].copy()
    result = np.zeros((len(wanted), 4))
    chosen, angle = np.empty(CAMERAS + 1, dtype=np.int64), np.empty(CAMERAS + 1)
    for i in range(len(wanted)):
        ray, z = wanted[i], depth[i]
        _choose(meeting, near, last, ray, z, chosen, angle)
        for j in range(CAMERAS):
            k = chosen[j]
            weight = 1 - angle[j] / angle[CAMERAS]
            if k < 0 or weight <= 0:
                continue
            last[k] = greedy_descent(points, tiles[k], last[k], ray, z, 0.0)
            if squared_distance(points, last[k], ray, z, 0.0) <= limit**2:
                _lend(points, tiles[k], colour, last[k], ray, z, weight, result[i])
        if result[i, 3] > 0:
            for c in range(3):
                result[i, c] /= result[i, 3]
    return result


@compiled
def _choose(
    meeting: Floats,
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
        far = depth - meeting[k, 2]
        if last[k] < 0 or far <= 0:
            continue
        across = (x - meeting[k, 0]) / far - ray[2]
        down = (y - meeting[k, 1]) / far - ray[3]
        away = np.sqrt(across * across + down * down)
        if away >= angle[-1]:
            continue
        j = len(angle) - 1
        while j > 0 and angle[j - 1] > away:
            angle[j], chosen[j] = angle[j - 1], chosen[j - 1]
            j -= 1
        angle[j], chosen[j] = away, k


@compiled
def _lend(
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
    width_of_bell = 2 * SIGMA_PX**2 * _pitch(points, tile, pixel, depth)
    for y in range(max(row - 1, 0), min(row + 2, height)):
        for x in range(max(column - 1, 0), min(column + 2, width)):
            other = first + y * width + x
            away = squared_distance(points, other, ray, depth, 0.0)
            if np.isnan(away):
                continue
            share = weight * np.exp(-away / width_of_bell)
            for c in range(3):
                total[c] += share * colour[other, c]
            total[3] += share


@compiled
def _pitch(points: Floats, tile: Ints, pixel: int, depth: float) -> float:
    """Mean squared distance of the rays of a pixel's four neighbours from its own, at a depth."""
    first, height, width = tile[0], tile[1], tile[2]
    row, column = divmod(pixel - first, width)
    own = points[pixel]
    total, count = 0.0, 0
    for step, there in (
        (-1, column > 0),
        (1, column + 1 < width),
        (-width, row > 0),
        (width, row + 1 < height),
    ):
        if there and not np.isnan(points[pixel + step, 0]):
            total += squared_distance(points, pixel + step, own, depth, 0.0)
            count += 1
    return total / count if count > 0 else 1.0
