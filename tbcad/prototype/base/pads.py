"""Directions of the three pads of a seat, in the seat's own frame."""

import numpy as np

from tbcad.geometry.rotations import unit_circle
from tbcad.types import Floats

PAD_AZIMUTHS = np.radians(np.arange(0, 120, 5))  # tried for the first pad


def pad_normals(tilt: float, azimuth: Floats) -> Floats:
    """Unit normals toward the ball's centre of the pads of k seats, (k, 3, 3).

    Args:
        tilt: angle to the seat's axis, which is z and away from the ball's pads, radians.
        azimuth: of each seat's first pad about the axis, radians, (k,).
    """
    around = azimuth[:, None] + np.arange(3) * 2 * np.pi / 3
    along = np.full((*around.shape, 1), np.cos(tilt))
    return -np.concatenate([np.sin(tilt) * unit_circle(around), along], axis=-1)
