"""Colours of plots, told apart by people with any colour vision, and the curve of sRGB."""

import numpy as np

from tbcad.types import Bytes, Floats

# M. Okabe and K. Ito, Color Universal Design, 2008; without yellow, which is faint on white.
BLUE, VERMILION, GREEN = "#0072b2", "#d55e00", "#009e73"
PURPLE, ORANGE, SKY, BLACK = "#cc79a7", "#e69f00", "#56b4e9", "#000000"
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Colours of lines and points, in this order."""

SHADES = "viridis"
"""matplotlib's name of the map for shades of one quantity."""
_VIRIDIS = (
    (68, 1, 84),
    (71, 45, 123),
    (59, 82, 139),
    (44, 114, 142),
    (33, 145, 140),
    (40, 174, 128),
    (94, 201, 98),
    (173, 220, 48),
    (253, 231, 37),
)


def shades(values: Floats) -> list[str]:
    """Colours `#rrggbb` of values (m,), from the smallest to the largest, as of viridis.

    Linear between nine of its colours, off by up to 0.07 of a channel, so that no plotting library
    is needed.
    """
    span = float(np.ptp(values)) or 1.0
    share = (values - values.min()) / span * (len(_VIRIDIS) - 1)
    table = np.array(_VIRIDIS).T
    channels = [np.interp(share, range(len(_VIRIDIS)), row) for row in table]
    return ["#{:02x}{:02x}{:02x}".format(*map(round, rgb)) for rgb in zip(*channels, strict=True)]


def srgb(light: Floats) -> Floats:
    """Light, 0 to 1, as IEC 61966-2-1 encodes it, 0 to 1."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def srgb_light(values: Floats) -> Floats:
    """The inverse of `srgb`."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def shown_colour(factor: Bytes) -> tuple[float, ...]:
    """Red, green, blue (sRGB) and opacity of a factor of glTF: bytes of light and of opacity."""
    *light, opacity = factor / 255
    return (*srgb(np.array(light)).tolist(), float(opacity))
