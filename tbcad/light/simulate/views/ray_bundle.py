"""Captured rays near some target rays, and the nearest of them (section 4.2 of the paper).

All rays of one mirror nearly meet in one point, its virtual pinhole. So a ray that passes that
point at distance e, at depth L, is at least e / sqrt(1 + (L / s)^2) from all of them in the
two-plane coordinates, less their own spread. Mirrors that are too far by that bound are left out;
within one, neighbouring pixels are neighbouring rays, so a few steps from pixel to pixel lead to
the best.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled
from tbcad.light.simulate.parallel import chunks, in_threads, over_chunks
from tbcad.light.simulate.views.mirror_tiles import MirrorTile
from tbcad.types import Bools, Bytes, Floats, Ints

# A ray at more than this to the direction has no coordinates.
MIN_COSINE = 0.2
COORDINATES_PER_CHUNK = 1 << 17
# Target rays that go through the loops together: neighbours, so that few mirrors are near.
RAYS_PER_CHUNK = 1 << 12
# Target rays in a row that are so near to each other that a few mirrors do for all of them.
RAYS_PER_RUN = 64
TILES_PER_CHUNK = 16


@dataclass(frozen=True)
class TwoPlane:
    """The parametrisation for one direction."""

    axes: Floats  # rows: two unit vectors across, and the direction of the view, (3, 3)
    scale: float  # s, mm

    def coordinates(
        self,
        origin: NDArray[np.floating],
        direction: NDArray[np.floating],
        valid: Bools | None = None,
    ) -> Floats:
        """Rays (n, 3), mm, as points (n, 4); NaN where too oblique, or not `valid` (n,)."""
        origin, direction = np.ascontiguousarray(origin), np.ascontiguousarray(direction)
        valid = np.ones(len(direction), dtype=np.bool_) if valid is None else valid
        result = np.empty((len(direction), 4))

        def fill(part: slice) -> None:
            self.fill(result[part], origin[part], direction[part], valid[part])

        in_threads(fill, chunks(len(direction), COORDINATES_PER_CHUNK))
        return result

    def fill(
        self,
        result: Floats,
        origin: NDArray[np.floating],
        direction: NDArray[np.floating],
        valid: Bools,
    ) -> None:
        """Write the `coordinates` of rays in contiguous arrays into an array (n, 4)."""
        _coordinates(np.ascontiguousarray(self.axes), self.scale, origin, direction, valid, result)

    def place(self, points: Floats) -> Floats:
        """Points (n, 3), mm, along the axes, the third over s, (n, 3)."""
        return np.asarray(points @ self.axes.T / [1, 1, self.scale])


def two_plane_along(forward: Floats, right: Floats, capture_mm: float) -> TwoPlane:
    """The parametrisation for a view along `forward`, whose rows run along `right`."""
    axes = np.stack([right, np.cross(forward, right), forward])
    return TwoPlane(axes, capture_mm / 2 / np.sqrt(3))


@compiled
def _coordinates(
    axes: Floats,
    scale: float,
    origin: NDArray[np.floating],
    direction: NDArray[np.floating],
    valid: Bools,
    result: Floats,
) -> None:
    for i in range(len(origin)):
        depth = speed = 0.0
        for j in range(3):
            depth += axes[2, j] * origin[i, j]
            speed += axes[2, j] * direction[i, j]
        if not valid[i] or speed < MIN_COSINE:
            result[i] = np.nan
            continue
        for k in range(2):
            across = slope = 0.0
            for j in range(3):
                across += axes[k, j] * origin[i, j]
                slope += axes[k, j] * direction[i, j]
            slope /= speed
            result[i, k] = across - depth * slope
            result[i, 2 + k] = scale * slope


@dataclass(frozen=True)
class RayBundle:
    """The rays of k mirrors, n in all."""

    two_plane: TwoPlane  # the parametrisation of the rays
    limit: float  # how far a ray may be from a target ray that it is used for, mm
    points: Floats  # two-plane coordinates, (n, 4); NaN at pixels of another mirror or too oblique
    # first pixel, height and width of each tile, and a pixel in its middle that has a ray, -1 if
    # none has, (k, 4). Pixels on the border of a tile have no ray.
    tiles: Ints
    # of the virtual cameras: across, across, depth over s, and how far from there the rays pass at
    # that depth, mm, (k, 4)
    pinholes: Floats
    colour: Bytes  # (n, 3)


def ray_bundle(two_plane: TwoPlane, tiles: list[MirrorTile], limit: float) -> RayBundle:
    """The rays of at least one tile."""
    shape = np.array([tile.shape for tile in tiles])
    ends = np.cumsum(shape.prod(axis=1))
    first = ends - shape.prod(axis=1)
    place = two_plane.place(np.stack([tile.pinhole for tile in tiles]))
    points, spread = np.empty((ends[-1], 4)), np.empty(len(tiles))

    def fill(part: slice) -> None:
        for k, tile in enumerate(tiles[part], part.start):
            rays = points[first[k] : ends[k]]
            two_plane.fill(rays, tile.origin, tile.direction, tile.valid)
            spread[k] = _spread(rays, place[k])

    in_threads(fill, chunks(len(tiles), TILES_PER_CHUNK))
    middle = first + np.array([tile.middle for tile in tiles])
    start = np.where(np.isnan(points[middle, 0]), -1, middle)
    return RayBundle(
        two_plane=two_plane,
        limit=limit,
        points=points,
        tiles=np.column_stack([first, shape, start]),
        pinholes=np.column_stack([place, spread]),
        colour=np.concatenate([tile.colour for tile in tiles]),
    )


@compiled
def _spread(points: Floats, pinhole: Floats) -> float:
    """Largest distance of rays (n, 4) from a point (3,) at its depth, mm; 0 without rays."""
    largest = 0.0
    for i in range(len(points)):
        x = points[i, 0] + pinhole[2] * points[i, 2] - pinhole[0]
        y = points[i, 1] + pinhole[2] * points[i, 3] - pinhole[1]
        largest = max(largest, x * x + y * y)  # never NaN
    return float(np.sqrt(largest))


@compiled
def boxes_around(targets: Floats, count: int) -> Floats:
    """Middles and half sides (r, 2, 4) of boxes that hold `count` targets (n, 4) in a row each.

    Targets without coordinates count for nothing; a box without any is NaN.
    """
    boxes = np.empty(((len(targets) + count - 1) // count, 2, 4))
    for run in range(len(boxes)):
        last = min((run + 1) * count, len(targets))
        for j in range(4):
            low, high = np.inf, -np.inf
            for i in range(run * count, last):
                low, high = min(low, targets[i, j]), max(high, targets[i, j])  # never NaN
            boxes[run, 0, j], boxes[run, 1, j] = (low + high) / 2, (high - low) / 2
    return boxes


@compiled
def mirrors_near_boxes(pinholes: Floats, boxes: Floats, limit: float) -> Ints:
    """Mirrors (c,) with rays within a limit of targets in boxes (r, 2, 4): middles, half sides."""
    kept = np.empty(len(pinholes), dtype=np.int64)
    count = 0
    for k in range(len(pinholes)):
        depth = pinholes[k, 2]
        margin = pinholes[k, 3] + limit * np.sqrt(1 + depth * depth)
        for run in range(len(boxes)):
            middle, half = boxes[run, 0], boxes[run, 1]
            x = abs(middle[0] + depth * middle[2] - pinholes[k, 0])
            y = abs(middle[1] + depth * middle[3] - pinholes[k, 1])
            if (
                x <= margin + half[0] + abs(depth) * half[2]
                and y <= margin + half[1] + abs(depth) * half[3]
            ):
                kept[count] = k
                count += 1
                break
    return kept[:count]


def nearest_rays(bundle: RayBundle, targets: Floats) -> Ints:
    """Pixel (n,) of the bundle nearest to each target (n, 4); -1 beyond the bundle's limit.

    Any order of the targets gives the same pixels; neighbours one after the other take less time.
    """
    # That far a ray may pass the virtual pinhole, for each mm of its distance from the target.
    reach = np.sqrt(1 + bundle.pinholes[:, 2] ** 2)

    def pixels(part: slice) -> Ints:
        arrays = bundle.points, bundle.tiles, bundle.pinholes, reach
        return _nearest(*arrays, targets[part], bundle.limit)

    return over_chunks(pixels, len(targets), RAYS_PER_CHUNK)


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
