"""Captured rays near some target rays, and the search for the best one of a mirror.

All rays of one mirror nearly meet in one point, its virtual pinhole. So a ray that passes that
point at distance e, at depth L, is at least e / sqrt(1 + (L / s)^2) from all of them in the
two-plane coordinates, less their own spread. Mirrors that are too far by that bound are left out;
within one, neighbouring pixels are neighbouring rays, so a few steps from pixel to pixel lead to
the best.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.simulate.parallel import compiled
from tbcad.simulate.views.mirror_tiles import MirrorTile
from tbcad.simulate.views.two_plane import TwoPlane
from tbcad.types import Bytes, Floats, Ints

# Target rays that go through the loops together: neighbours, so that few mirrors are near.
RAYS_PER_CHUNK = 1 << 11
# Every 31st target ray is looked at to find the mirrors near a chunk of them.
SAMPLED_RAY_STEP = 31


@dataclass(frozen=True)
class RayBundle:
    """The rays of k mirrors, n in all.

    Attributes:
        two_plane: the parametrisation of the rays.
        limit: how far a ray may be from a target ray that it is used for, mm.
        points: two-plane coordinates, (n, 4); NaN at pixels of another mirror or too oblique.
        tiles: first pixel, height and width of each tile, and a pixel in its middle that has a
            ray, -1 if none has, (k, 4).
        pinholes: of the virtual cameras: across, across, depth over s, and how far from there
            the rays pass, mm, (k, 4).
        colour: (n, 3).
    """

    two_plane: TwoPlane
    limit: float
    points: Floats
    tiles: Ints
    pinholes: Floats
    colour: Bytes


def ray_bundle(two_plane: TwoPlane, tiles: list[MirrorTile], limit: float) -> RayBundle:
    """The rays of at least one tile."""
    origin, direction, valid, colour = (
        np.concatenate([getattr(tile, name) for tile in tiles])
        for name in ("origin", "direction", "valid", "colour")
    )
    points = two_plane.coordinates(origin, direction, valid)
    shape = np.array([tile.shape for tile in tiles])
    first = np.cumsum(shape.prod(axis=1)) - shape.prod(axis=1)
    middle = first + np.array([tile.middle for tile in tiles])
    start = np.where(np.isnan(points[middle, 0]), -1, middle)
    pinhole = two_plane.place(np.stack([tile.pinhole for tile in tiles]))
    spread = np.array([tile.spread for tile in tiles])
    return RayBundle(
        two_plane=two_plane,
        limit=limit,
        points=points,
        tiles=np.column_stack([first, shape, start]),
        pinholes=np.column_stack([pinhole, spread]),
        colour=colour,
    )


@compiled
def candidate_mirrors(pinholes: Floats, targets: Floats, limit: float, step: int) -> Ints:
    """Mirrors (c,) whose rays may be within a limit of target rays that are neighbours.

    Args:
        pinholes: as in `RayBundle`, (k, 4).
        targets: two-plane coordinates, (n, 4).
        limit: mm.
        step: between the targets that are looked at; the last one always is.
    """
    kept = np.empty(len(pinholes), dtype=np.int64)
    count = 0
    for k in range(len(pinholes)):
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for i in range(0, len(targets) + step - 1, step):
            ray = targets[min(i, len(targets) - 1)]
            for j in range(2):
                across = ray[j] + pinholes[k, 2] * ray[2 + j] - pinholes[k, j]
                low[j], high[j] = min(low[j], across), max(high[j], across)
        margin = pinholes[k, 3] + limit * np.sqrt(1 + pinholes[k, 2] ** 2)
        if low[0] <= margin and high[0] >= -margin and low[1] <= margin and high[1] >= -margin:
            kept[count] = k
            count += 1
    return kept[:count]


@compiled
def squared_distance(
    points: Floats, pixel: int, target: Floats, depth: float, slopes: float
) -> float:
    """Squared distance of a pixel's ray from a target ray; NaN where there is no ray.

    At a depth (over s) and, with that weight, of their slopes: depth 0 and weight 1 make it the
    distance in two-plane coordinates, weight 0 the distance at the depth alone.
    """
    a, b = points[pixel, 2] - target[2], points[pixel, 3] - target[3]
    x, y = points[pixel, 0] - target[0] + depth * a, points[pixel, 1] - target[1] + depth * b
    result: float = x * x + y * y + slopes * (a * a + b * b)
    return result


@compiled
def greedy_descent(
    points: Floats, tile: Ints, start: int, target: Floats, depth: float, slopes: float
) -> int:
    """The pixel of a tile that is nearer than all its neighbours, by steps from a pixel on."""
    first, height, width = tile[0], tile[1], tile[2]
    best = squared_distance(points, start, target, depth, slopes)
    pixel = start
    while True:
        y, x = divmod(pixel - first, width)
        nearer = pixel
        for row in range(max(y - 1, 0), min(y + 2, height)):
            for column in range(max(x - 1, 0), min(x + 2, width)):
                other = first + row * width + column
                distance = squared_distance(points, other, target, depth, slopes)
                if distance < best:  # never so for NaN
                    best, nearer = distance, other
        if nearer == pixel:
            return pixel
        pixel = nearer
