"""The hull of the object: what rays that see the background do not pass through."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tbcad.compiled import compiled_sum
from tbcad.errors import InputError
from tbcad.reconstruction.rays import CapturedRays, Singles
from tbcad.simulate.parallel import chunks
from tbcad.types import Bools

NODES = (12, 64)  # along an edge: the fewest and the most
RAYS_OF_NODE = 5  # at least, in the mean
MOST_DARK = 0.3  # share of a voxel's rays that may see the background, past its edges
PARTS = 8  # of the rays, whatever the number of threads


def hull(rays: CapturedRays, pool: ThreadPoolExecutor) -> Bools:
    """Nodes of a lattice (k, k, k) over the capture sphere's cube where the object may be.

    Raises:
        InputError: the photographs show nothing, or no background.
    """
    level = rays.dark_level()
    dark = rays.colour.max(axis=1) < level
    if dark.all():
        raise InputError(
            f"the photographs show nothing brighter than {level:.1%} of white before a dark "
            "background: light the object, or expose longer, and capture again"
        )
    found = _inside(rays, dark, pool)
    if not found.any():
        raise InputError(
            "the photographs show no object before a dark background: it must fit into the "
            f"capture sphere of {rays.capture_mm:g} mm, and what is behind it must be black"
        )
    return np.asarray(ndimage.binary_dilation(found))


def _inside(rays: CapturedRays, dark: Bools, pool: ThreadPoolExecutor) -> Bools:
    """Nodes that few of the rays near them see the background through."""
    n = int(np.clip((len(rays) / RAYS_OF_NODE) ** 0.5, *NODES))
    scale, shape = (n - 1) / rays.capture_mm, (2, n, n, n)

    def count(part: slice) -> NDArray[np.int32]:
        votes = np.zeros(shape, dtype=np.int32)
        _vote(rays.entry[part], rays.direction[part], rays.length[part], dark[part], scale, votes)
        return votes

    count(slice(0, 0))  # compiled before any thread
    parts = chunks(len(rays), max(-(-len(rays) // PARTS), 1))
    total, seen_through = sum(pool.map(count, parts), np.zeros(shape, dtype=np.int64))
    return np.asarray((total > 0) & (seen_through < MOST_DARK * total))


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
