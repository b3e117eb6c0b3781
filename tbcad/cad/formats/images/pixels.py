"""Pixels of pictures: what is taken of them, shared by the readers of the file formats."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError

Picture: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]
"""Grey (h, w) or red, green, blue (h, w, 3)."""

MOST_PIXELS = 178_956_970  # as Pillow has it: more fill the memory rather than show anything
GIVE = "save it as PNG or TIFF, grey or RGB, of 8 or 16 bits"


def damaged(name: str, error: Exception | str) -> InputError:
    """The error of a picture that cannot be read whole."""
    reason = str(error) or type(error).__name__
    return InputError(f"{name} is damaged or cut short: {reason}: copy or photograph it again")


def check_pixels(name: str, width: int, height: int) -> None:
    """Refuse (InputError) a picture without pixels, or with more than any camera has."""
    if not 0 < width * height <= MOST_PIXELS:
        raise InputError(
            f"{name} says that it has {width} x {height} pixels, allowed are {MOST_PIXELS}: "
            "make it smaller"
        )


def without_alpha(pixels: NDArray[Any], opaque: float, name: str, ignore: bool) -> NDArray[Any]:
    """Pixels (h, w, 2) or (h, w, 4), grey or red, green, blue, without their last, the opacity.

    InputError if it is not opaque everywhere, unless that is ignored: what is seen there is not in
    the picture.
    """
    if not ignore and (pixels[..., -1] != opaque).any():
        raise transparent(name)
    return pixels[..., 0] if pixels.shape[2] == 2 else pixels[..., :3]


def transparent(name: str) -> InputError:
    """The error of a picture whose colours depend on what is behind it."""
    return InputError(f"{name} is transparent in places: lay it on a background, and {GIVE}")


def as_light(pixels: NDArray[Any], name: str) -> NDArray[np.float32]:
    """Floating-point pixels as light; InputError if some are negative, infinite or no numbers."""
    with np.errstate(over="ignore"):
        light = pixels.astype(np.float32)
    if not np.isfinite(light).all() or (light < 0).any():
        raise InputError(
            f"{name} has values that are no light (negative, infinite or NaN): repair it"
        )
    return light


def import_of_machine(module: str, name: str) -> Any:
    """A library of the extra `machine`, which a picture of this name needs; or InputError."""
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError:
        raise InputError(
            f"{name} is read by {module}, which is not installed: pip install 'tbcad[machine]'"
        ) from None
