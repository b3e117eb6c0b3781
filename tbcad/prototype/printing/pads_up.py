"""Pads as they are printed: how many face down, and the direction in which none does."""

import numpy as np
from scipy.optimize import nnls

from tbcad.types import Floats

LEVEL = 1e-6  # of a normal's downward part
STEEP = np.sin(np.radians(45))  # of it, from which on a printer needs support
EXACT = 1e3  # weight of the sum of shares, which is one
NO_PADS = np.zeros((0, 3))


def downward_pads(normals: Floats, orientation: Floats) -> tuple[int, int]:
    """Pads that face down by more than 45 degrees, and all that face down.

    Args:
        normals: unit, (n, 3).
        orientation: rows that the axes become, the third is up on the bed, (3, 3).
    """
    height = normals @ orientation[:, 2]
    return int((height < -STEEP).sum()), int((height < -LEVEL).sum())


def opening_up(normals: Floats) -> Floats | None:
    """Unit direction that is down when the pad nearest to facing down is as far up as possible.

    The point of the normals' convex hull that is nearest to the origin is up.

    Args:
        normals: unit, (n, 3).

    Returns:
        (3,), or None where some pad faces down in every direction.
    """
    if not len(normals):
        return None
    weighed = np.vstack([normals.T, np.full(len(normals), EXACT)])
    shares, _ = nnls(weighed, np.array([0.0, 0.0, 0.0, EXACT]))
    up = normals.T @ shares
    length = float(np.linalg.norm(up))
    if length < LEVEL or float((normals @ up).min()) < LEVEL * length:
        return None
    return np.asarray(-up / length)
