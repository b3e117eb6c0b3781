"""Photographs as three channels of 8 or 16 bits, of whatever the reader of pictures gives."""

from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.pictures import Picture, picture_of, read_picture
from tbcad.errors import InputError

Image16: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]


def read_image(path: Path) -> Image16:
    """The photograph in a file, (h, w, 3), 8 or 16 bits a channel.

    Raises:
        InputError: it cannot be read, or not exactly.
    """
    return _three_channels(read_picture(path), str(path))


def decoded_image(data: bytes, name: str) -> Image16:
    """The photograph in the bytes of a file of this name; else as `read_image`."""
    return _three_channels(picture_of(data, name), name)


def _three_channels(picture: Picture, name: str) -> Image16:
    whole: NDArray[Any] = _in_16_bits(picture, name) if picture.dtype == np.float32 else picture
    return whole if whole.ndim == 3 else np.repeat(whole[..., None], 3, axis=2)


def _in_16_bits(light: Picture, name: str) -> Image16:
    """Floating-point light, 0 to 1, to the nearest of 65,535 steps."""
    if light.max() > 1:
        raise InputError(
            f"{name} has light of {light.max():g}: allowed in floating point is 0 to 1: scale all "
            "photographs alike"
        )
    return np.rint(light.astype(np.float64) * 65_535).astype(np.uint16)
