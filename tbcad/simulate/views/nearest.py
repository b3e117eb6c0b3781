"""The nearest captured ray to each wanted one (section 4.2 of the paper).

tests/simulate/test_nearest.py compares with a four-dimensional k-d tree over all rays.
"""

import numpy as np

from tbcad.simulate.parallel import compiled, in_threads
from tbcad.simulate.views.ray_bundle import (
    SAMPLED_RAY_STEP,
    RayBundle,
    candidate_mirrors,
    greedy_descent,
    ray_chunks,
    squared_distance,
)
from tbcad.types import Floats, Ints

# Wanted rays in a row that are so near to each other that a few mirrors do for all of them.
RAYS_PER_RUN = 64


def nearest_rays(sheaf: RayBundle, wanted: Floats, limit: float) -> Ints:
    """Packed pixel (n,) nearest to each wanted point (n, 4) of the slab; -1 beyond a limit, mm."""

    def found(part: slice) -> Ints:
        return _nearest(sheaf.points, sheaf.tiles, sheaf.meeting, wanted[part], limit)

    return np.concatenate(
        [np.zeros(0, dtype=np.int64), *in_threads(found, ray_chunks(len(wanted)))]
    )


@compiled
def _nearest(points: Floats, tiles: Ints, meeting: Floats, wanted: Floats, limit: float) -> Ints:
    about = candidate_mirrors(meeting, wanted, limit, SAMPLED_RAY_STEP)
    near, likely = about, -1
    last = tiles[:, 3].copy()
    # How near each mirror came, or may have come, when last asked, and how far the wanted rays have
    # gone since: they cannot have come nearer by more than that.
    came, way = np.full(len(tiles), -np.inf), 0.0
    found = np.full(len(wanted), -1, dtype=np.int64)
    for i in range(len(wanted)):
        ray = wanted[i]
        if i % RAYS_PER_RUN == 0:
            near = about[candidate_mirrors(meeting[about], wanted[i : i + RAYS_PER_RUN], limit, 4)]
        if i > 0:
            step = 0.0
            for j in range(4):
                step += (ray[j] - wanted[i - 1, j]) ** 2
            way += np.sqrt(step)
        best, owner = limit, -1
        for turn in range(-1, len(near)):
            k = likely if turn < 0 else near[turn]
            if k < 0 or last[k] < 0 or came[k] - way >= best or (turn >= 0 and k == likely):
                continue
            least = _bound(meeting[k], ray) if turn >= 0 else 0.0
            if least >= best:
                came[k] = least + way
                continue
            last[k] = greedy_descent(points, tiles[k], last[k], ray, 0.0, 1.0)
            away = np.sqrt(squared_distance(points, last[k], ray, 0.0, 1.0))
            came[k] = away + way
            if away < best:
                best, found[i] = away, last[k]
                owner = k
        likely = owner
    return found


@compiled
def _bound(meeting: Floats, ray: Floats) -> float:
    """Least distance that a mirror's rays can have from a wanted one, mm."""
    x = ray[0] + meeting[2] * ray[2] - meeting[0]
    y = ray[1] + meeting[2] * ray[3] - meeting[1]
    past = max(np.sqrt(x * x + y * y) - meeting[3], 0.0)
    result: float = past / np.sqrt(1 + meeting[2] ** 2)
    return result
