"""Places of the rays of a pixel that is more than its central ray."""

import numpy as np

from tbcad.reconstruction.marching import Singles

PATTERNS = 8  # turned against each other
SQUARE_VARIANCE = 1 / 12  # of a pixel's square, along each side
GOLDEN_ANGLE = np.pi * (3 - 5**0.5)


def pixel_places(count: int, blur_px: float = 0.0, *, area: bool = True) -> Singles:
    """Places of a pixel's rays from its centre in each of p patterns, pixels, (p, count, 2).

    On Vogel's spiral, with the density of a Gaussian of the variance that the pixel's square and
    the lens' spread have together; their mean is zero and their variance exact in each pattern's
    sum of both ways. Few rays are worse than one: a step of light inside of a pixel is then a
    stair (docs/reconstruct.md).

    Args:
        count: of rays.
        blur_px: standard deviation of the lens' spread.
        area: whether a pixel is the mean of its square, and not a single ray.
    """
    k = np.arange(count)
    radius = np.sqrt(-2 * np.log(1 - (k + 0.5) / count))
    angle = k * GOLDEN_ANGLE + 2 * np.pi * np.arange(PATTERNS)[:, None] / PATTERNS
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    places -= places.mean(axis=1, keepdims=True)
    sigma = np.sqrt(blur_px**2 + area * SQUARE_VARIANCE)
    return np.asarray(places * sigma / np.sqrt(np.mean(places**2)), dtype=np.float32)
