"""How well centroids are known, by the noise that the photographs themselves show.

A pixel's variance is that of its light, gain times number, and one that does not depend on light:
of reading and rounding. The gain is seen where the LED is white: the colours of a pixel should then
keep their ratio.
"""

import numpy as np

from tbcad.calibration.detection.spots import ROUNDING, Spots
from tbcad.runs.images import Image16
from tbcad.types import Floats

COLOURS = 3
CLIP = 5.0  # in numbers: larger differences of dark photographs are of hot pixels
# Electrons that fill a pixel where colours do not tell: a sensor with pixels of 3.45 um.
FULL_ELECTRONS = 10_000.0
# What the model of domes leaves open, dust, and what a lens as sharp as its pixels adds, pixels.
FLOOR_PX = 0.006


def reading_variance(dark: Image16, other: Image16) -> float:
    """Variance of a number without light, from two dark photographs."""
    change = np.clip(dark.astype(np.float32) - other.astype(np.float32), -CLIP, CLIP)
    return float((change**2).mean() / 2) + ROUNDING


def gain(spots: Spots, reading: float, largest: float) -> float:
    """Variance of light over light, in numbers."""
    pixels = np.pi * spots.radius**2
    known = spots.colours != 0
    if not known.any():
        return largest / FULL_ELECTRONS
    read = (reading - ROUNDING) * pixels[known].sum()
    variance = spots.colours[known].sum() / (COLOURS - 1) - read
    return float(max(variance / (spots.light[known].sum() / COLOURS), 0.0))


def centroid_sigmas(spots: Spots, reading: float, of_light: float) -> Floats:
    """Standard deviation of each centroid, of column and of row, pixels, (n,)."""
    variance = (of_light * spots.shot + COLOURS * reading * spots.spread) / spots.light**2
    return np.asarray(np.sqrt(variance + FLOOR_PX**2))
