"""Raw files of cameras: what the sensor measured, by LibRaw."""

from io import BytesIO
from typing import Any

import numpy as np

from tbcad.cad.formats.images.pixels import Picture, check_pixels, import_of_machine
from tbcad.errors import InputError

RAW_SUFFIXES = (
    *(".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dcr", ".dng", ".erf", ".iiq", ".kdc", ".mef"),
    *(".mos", ".mrw", ".nef", ".nrw", ".orf", ".pef", ".raf", ".raw", ".rw2", ".rwl", ".sr2"),
    *(".srf", ".srw", ".x3f"),
)


def raw_picture(data: bytes, name: str) -> Picture:
    """Light in the camera's own colours, (h, w, 3) or (h, w), uint16, proportional to light.

    The black level is 0 and the white level 65535. No white balance (an automatic one differs
    between photographs), no colour matrix, no automatic brightness, no turn by the orientation;
    colours between the pixels of the mosaic by linear interpolation. InputError if LibRaw cannot
    read it, or rawpy is not installed.
    """
    rawpy = import_of_machine("rawpy", name)
    try:
        with rawpy.imread(BytesIO(data)) as raw:
            check_pixels(name, raw.sizes.width, raw.sizes.height)
            pixels = raw.postprocess(_linear(rawpy))
    except rawpy.LibRawError as error:
        reason = error.args[0] if error.args else ""
        words = reason.decode("ascii", "replace") if isinstance(reason, bytes) else reason
        raise InputError(
            f"{name} is damaged, or of a camera that LibRaw does not know: {words}: save it as DNG "
            "or as TIFF of 16 bits"
        ) from None
    return np.asarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)


def _linear(rawpy: Any) -> Any:
    return rawpy.Params(
        demosaic_algorithm=rawpy.DemosaicAlgorithm.LINEAR,
        user_wb=[1.0, 1.0, 1.0, 1.0],
        output_color=rawpy.ColorSpace.raw,
        output_bps=16,
        gamma=(1, 1),
        no_auto_bright=True,
        adjust_maximum_thr=0.0,  # else the white level follows the brightest pixel
        user_flip=0,
    )
