"""Places of the rays of a pixel that is more than its central ray."""

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from tbcad.reconstruction.marching import Singles
from tbcad.types import Floats

PATTERNS = 64  # a power of two, for Sobol's sequence
SQUARE_VARIANCE = 1 / 12  # of a square of one pixel, along each side


def pixel_places(blur_px: float = 0.0) -> Singles:
    """Places of four rays from a pixel's centre in each of p patterns, pixels, (p, 4, 2).

    They are drawn from the pixel's square convolved with a Gaussian; evenly, by Sobol's sequence,
    and the same each time. Rays 0 and 2 lie opposite each other, rays 1 and 3 too, so that each
    half of a pattern has the mean zero: the gradient (tbcad.reconstruction.marching.add_gradient)
    is that of the mean light only if both halves are independent, so one is no complement of the
    other. Their variance over all patterns is exactly that of the distribution.

    Args:
        blur_px: standard deviation of the Gaussian.
    """
    uniform = qmc.Sobol(8, scramble=True, rng=np.random.default_rng(0)).random(PATTERNS)
    drawn = np.clip(uniform, 2.0**-30, 1 - 2.0**-30).reshape(PATTERNS, 2, 2, 2)
    half: Floats = drawn[:, :, 0] - 0.5 + blur_px * ndtri(drawn[:, :, 1])
    half *= np.sqrt((SQUARE_VARIANCE + blur_px**2) / (half**2).mean(axis=(0, 1)))
    return np.concatenate([half, -half], axis=1).astype(np.float32)
