"""The nearest captured ray to each target ray (section 4.2 of the paper).

tests/simulate/views/test_nearest.py compares with a four-dimensional k-d tree over all rays.
"""

import numpy as np

from tbcad.simulate.parallel import chunks, compiled, in_threads
from tbcad.simulate.views.ray_bundle import (
    RAYS_PER_CHUNK,
    SAMPLED_RAY_STEP,
    RayBundle,
    candidate_mirrors,
    greedy_descent,
    squared_distance,
)
from tbcad.types import Floats, Ints

# Target rays in a row that are so near to each other that a few mirrors do for all of them.
RAYS_PER_RUN = 64
SAMPLED_IN_RUN = 4


def nearest_rays(bundle: RayBundle, targets: Floats) -> Ints:
    """Pixel (n,) of the bundle nearest to each target (n, 4); -1 beyond the bundle's limit."""

    def pixels(part: slice) -> Ints:
        arrays = bundle.points, bundle.tiles, bundle.pinholes
        return _nearest(*arrays, targets[part], bundle.limit)

    parts = in_threads(pixels, chunks(len(targets), RAYS_PER_CHUNK))
    return np.concatenate([np.zeros(0, dtype=np.int64), *parts])


@compiled
def _nearest(points: Floats, tiles: Ints, pinholes: Floats, targets: Floats, limit: float) -> Ints:
    near_chunk = candidate_mirrors(pinholes, targets, limit, SAMPLED_RAY_STEP)
    near, previous = near_chunk, -1
    last = tiles[:, 3].copy()
    # How near each mirror came, or may have come, when last asked, and how far the targets have
    # moved since: they cannot have come nearer by more than that.
    came, moved = np.full(len(tiles), -np.inf), 0.0
    result = np.full(len(targets), -1, dtype=np.int64)
    for i in range(len(targets)):
        ray = targets[i]
        if i % RAYS_PER_RUN == 0:
            run = targets[i : i + RAYS_PER_RUN]
            near = near_chunk[candidate_mirrors(pinholes[near_chunk], run, limit, SAMPLED_IN_RUN)]
        if i > 0:
            step = 0.0
            for j in range(4):
                step += (ray[j] - targets[i - 1, j]) ** 2
            moved += np.sqrt(step)
        best, owner = limit, -1
        for rank in range(-1, len(near)):  # first the mirror of the previous target
            k = previous if rank < 0 else near[rank]
            if k < 0 or last[k] < 0 or came[k] - moved >= best or (rank >= 0 and k == previous):
                continue
            bound = _lower_bound(pinholes[k], ray) if rank >= 0 else 0.0
            if bound >= best:
                came[k] = bound + moved
                continue
            last[k] = greedy_descent(points, tiles[k], last[k], ray, 0.0, 1.0)
            distance = np.sqrt(squared_distance(points, last[k], ray, 0.0, 1.0))
            came[k] = distance + moved
            if distance < best:
                best, result[i] = distance, last[k]
                owner = k
        previous = owner
    return result


@compiled
def _lower_bound(pinhole: Floats, ray: Floats) -> float:
    """Minimum distance that a mirror's rays can have from a target ray, mm."""
    x = ray[0] + pinhole[2] * ray[2] - pinhole[0]
    y = ray[1] + pinhole[2] * ray[3] - pinhole[1]
    past = max(np.sqrt(x * x + y * y) - pinhole[3], 0.0)
    result: float = past / np.sqrt(1 + pinhole[2] ** 2)
    return result
