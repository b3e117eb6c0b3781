"""The hull of the object: what rays that see the background do not pass through."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tbcad.compiled import compiled_sum
from tbcad.reconstruct.rays import CapturedRays, Singles
from tbcad.simulate.parallel import chunks
from tbcad.types import Bools

HULL_NODES = 64
MOST_DARK = 0.3  # share of a voxel's rays that may see the background, past its edges
PARTS = 8  # of the rays, whatever the number of threads


def hull(rays: CapturedRays, pool: ThreadPoolExecutor) -> Bools:
    """Nodes of a lattice (k, k, k) over the capture sphere's cube where the object may be."""
    dark = rays.colour.max(axis=1) < rays.dark_level()
    scale = (HULL_NODES - 1) / rays.capture_mm

    def count(part: slice) -> NDArray[np.int32]:
        votes = np.zeros((2,) + (HULL_NODES,) * 3, dtype=np.int32)
        _vote(rays.entry[part], rays.direction[part], rays.length[part], dark[part], scale, votes)
        return votes

    parts = chunks(len(rays), max(-(-len(rays) // PARTS), 1))
    total, seen_through = sum(pool.map(count, parts), np.zeros((2,) + (HULL_NODES,) * 3, int))
    inside = (total > 0) & (seen_through < MOST_DARK * total)
    return np.asarray(ndimage.binary_dilation(inside))


@compiled_sum
def _vote(
    entry: Singles,
    direction: Singles,
    length: Singles,
    dark: Bools,
    scale: float,
    votes: NDArray[np.int32],
) -> None:
    """Count all rays near each node, and those that see the background."""
    middle = np.float32((votes.shape[1] - 1) / 2 + 0.5)
    for i in range(len(entry)):
        for k in range(int(length[i] * scale)):
            t = (k + np.float32(0.5)) / scale
            x = int((entry[i, 0] + direction[i, 0] * t) * scale + middle)
            y = int((entry[i, 1] + direction[i, 1] * t) * scale + middle)
            z = int((entry[i, 2] + direction[i, 2] * t) * scale + middle)
            votes[0, x, y, z] += 1
            if dark[i]:
                votes[1, x, y, z] += 1
