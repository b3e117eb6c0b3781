"""Captured rays as points of a slab, and how the one that is wanted is found among a mirror's.

All rays of one mirror nearly meet in one point. So a ray that passes that point at distance e, at
depth L, is at least e / sqrt(1 + (L / s)^2) from all of them in the slab, less their own spread.
Mirrors that are too far by that bound are left out; within one, neighbouring pixels are
neighbouring rays, so a few steps from pixel to pixel lead to the best.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.simulate.parallel import compiled
from tbcad.simulate.views.mirror_tiles import PackedTiles
from tbcad.simulate.views.two_plane import TwoPlane
from tbcad.types import Floats, Ints

# Wanted rays that go through the loops together: neighbours, so that few mirrors are near.
RAYS_PER_CHUNK = 1 << 11
# One wanted ray of so many tells which mirrors are near a piece of them.
SAMPLED_RAY_STEP = 31


@dataclass(frozen=True)
class RayBundle:
    """Packed rays of k mirrors as points of one slab.

    Attributes:
        points: NaN where a pixel is of another mirror or too oblique, (n, 4).
        tiles: first pixel, height and width of each tile, and a pixel in its middle that has a
            ray, -1 if none has, (k, 4).
        meeting: where each mirror's rays nearly meet: across, across, depth over s, and how far
            from there they pass, mm, (k, 4).
        colour: (n, 3), uint8.
    """

    points: Floats
    tiles: Ints
    meeting: Floats
    colour: NDArray[np.uint8]


def ray_bundle(slab: TwoPlane, packed: PackedTiles) -> RayBundle:
    """Rays of tiles in a slab."""
    points = slab.points(packed.origin, packed.direction, packed.valid)
    place = slab.place(packed.pinhole) / [1, 1, slab.scale]
    start = np.where(np.isnan(points[packed.middle, 0]), -1, packed.middle)
    tiles = np.column_stack([packed.first, packed.shape, start])
    return RayBundle(points, tiles, np.column_stack([place, packed.spread]), packed.colour)


def ray_chunks(count: int) -> list[slice]:
    """Slices of so many wanted rays that go through the loops together."""
    return [slice(k, k + RAYS_PER_CHUNK) for k in range(0, count, RAYS_PER_CHUNK)]


@compiled
def candidate_mirrors(meeting: Floats, wanted: Floats, limit: float, step: int) -> Ints:
    """Mirrors (c,) whose rays may be within a limit of wanted ones that are neighbours.

    Args:
        meeting: of each mirror, as in `Sheaf`, (k, 4).
        wanted: points of the slab, (n, 4).
        limit: mm.
        step: every so manieth wanted ray is looked at.
    """
    kept = np.empty(len(meeting), dtype=np.int64)
    count = 0
    for k in range(len(meeting)):
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for i in range(0, len(wanted) + step - 1, step):
            ray = wanted[min(i, len(wanted) - 1)]
            for j in range(2):
                across = ray[j] + meeting[k, 2] * ray[2 + j] - meeting[k, j]
                low[j], high[j] = min(low[j], across), max(high[j], across)
        room = meeting[k, 3] + limit * np.sqrt(1 + meeting[k, 2] ** 2)
        if low[0] <= room and high[0] >= -room and low[1] <= room and high[1] >= -room:
            kept[count] = k
            count += 1
    return kept[:count]


@compiled
def squared_distance(
    points: Floats, pixel: int, wanted: Floats, depth: float, slopes: float
) -> float:
    """Squared distance of a pixel's ray from a wanted one; NaN where there is no ray.

    At a depth (over s) and, with that weight, of their slopes: depth 0 and weight 1 make it the
    distance in the slab, weight 0 the distance at the depth alone.
    """
    a, b = points[pixel, 2] - wanted[2], points[pixel, 3] - wanted[3]
    x, y = points[pixel, 0] - wanted[0] + depth * a, points[pixel, 1] - wanted[1] + depth * b
    result: float = x * x + y * y + slopes * (a * a + b * b)
    return result


@compiled
def greedy_descent(
    points: Floats, tile: Ints, start: int, wanted: Floats, depth: float, slopes: float
) -> int:
    """The pixel of a tile that is nearer than all its neighbours, by steps from a pixel on."""
    first, height, width = tile[0], tile[1], tile[2]
    best = squared_distance(points, start, wanted, depth, slopes)
    pixel = start
    while True:
        y, x = divmod(pixel - first, width)
        moved = pixel
        for row in range(max(y - 1, 0), min(y + 2, height)):
            for column in range(max(x - 1, 0), min(x + 2, width)):
                other = first + row * width + column
                away = squared_distance(points, other, wanted, depth, slopes)
                if away < best:  # never so for NaN
                    best, moved = away, other
        if moved == pixel:
            return pixel
        pixel = moved
