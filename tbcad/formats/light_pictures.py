"""Pictures whose numbers are proportional to light without a limit: Radiance, OpenEXR, TIFF."""

from pathlib import Path

import numpy as np

from tbcad.errors import InputError
from tbcad.formats import openexr, radiance
from tbcad.formats.openexr import exr_picture
from tbcad.formats.pictures import picture_of
from tbcad.formats.radiance import hdr_picture
from tbcad.types import Floats

GIVE = "give a picture of light: Radiance (.hdr), OpenEXR (.exr) or TIFF in floating point"


def read_light(path: Path) -> Floats:
    """Red, green and blue (h, w, 3), linear, colours of Rec. 709, from the top row down.

    Raises:
        InputError: it cannot be read, or is no picture of light.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; {GIVE}") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}: {GIVE}") from None
    if data.startswith(radiance.SIGNATURE):
        return hdr_picture(data, str(path))
    light = exr_picture(path) if data.startswith(openexr.SIGNATURE) else picture_of(data, str(path))
    if light.dtype != np.float32:
        raise InputError(f"{path} has whole numbers, which clip what is bright: {GIVE}")
    grey = light[..., None] if light.ndim == 2 else light
    return np.broadcast_to(grey, (*light.shape[:2], 3)).astype(np.float64)
