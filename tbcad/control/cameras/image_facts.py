"""What a photograph's file says: size, exposure time, settings.

Source: Exif 2.32, tables 4 and 7.
"""

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image

from tbcad.control.faults import CameraFault
from tbcad.runs.exposure import SUFFIXES, Setting

FORMATS = {"PNG": ".png", "TIFF": ".tif", "JPEG": ".jpg"}
SAME_FORMAT = {".tiff": ".tif", ".jpeg": ".jpg"}
MAKE, MODEL, EXIF = 0x010F, 0x0110, 0x8769
EXPOSURE = 0x829A
DECIMALS = 9  # of numbers that Exif has as fractions
# What must not change in a run, by the names that gphoto2 has for it where it has one.
LOCKED = {
    EXPOSURE: "exposure_s",
    0x829D: "f_number",
    0x8827: "iso",
    0xA403: "white_balance",
    0x920A: "focal_length_mm",
}


@dataclass(frozen=True)
class ImageFacts:
    """What a photograph's file says.

    Attributes:
        width_px: columns.
        height_px: rows.
        model: of the camera; empty if the file does not say.
        exposure_s: exposure time; None if the file does not say.
        settings: that must not change in a run, as far as the file says them.
    """

    width_px: int
    height_px: int
    model: str
    exposure_s: float | None
    settings: dict[str, Setting]


def image_facts(data: bytes, suffix: str) -> ImageFacts:
    """Read all of an image file.

    Raises:
        CameraFault: it is no image of a kind that a run takes, or not complete.
    """
    if suffix not in SUFFIXES:
        raise CameraFault(
            f"the camera gives {suffix or 'nameless'} files: set its image format to JPEG, TIFF or "
            "PNG"
        )
    try:
        with Image.open(io.BytesIO(data)) as image:
            kind, size = image.format, image.size
            tags = image.getexif()
            inner = tags.get_ifd(EXIF)
            image.load()  # after the tags: it closes the file of a TIFF
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise CameraFault(f"the photograph cannot be read: {error}") from None
    if FORMATS.get(kind or "") != SAME_FORMAT.get(suffix, suffix):
        raise CameraFault(f"the photograph is a {kind} file and is called {suffix}")
    told = {name: _setting(inner.get(tag)) for tag, name in LOCKED.items()}
    exposure = told[LOCKED[EXPOSURE]]
    return ImageFacts(
        width_px=size[0],
        height_px=size[1],
        model=" ".join(str(tags[tag]).strip("\0 ") for tag in (MAKE, MODEL) if tag in tags),
        exposure_s=float(exposure) if exposure and not isinstance(exposure, str) else None,
        settings={name: value for name, value in told.items() if value is not None},
    )


def suffix_of(name: str) -> str:
    """Suffix of a file's name in small letters."""
    return Path(name).suffix.lower()


def _setting(value: Any) -> Setting | None:
    """A tag's value as JSON has it; None: not told."""
    if isinstance(value, tuple):
        value = value[0] if value else None
    if value is None or isinstance(value, str | int):
        return value
    try:
        number = round(float(value), DECIMALS)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) else None
