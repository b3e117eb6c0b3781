"""Light and the numbers that show it: the curve of sRGB (IEC 61966-2-1)."""

import numpy as np

from tbcad.types import Bytes, Floats


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
