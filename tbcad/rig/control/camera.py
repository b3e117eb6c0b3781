"""What a run asks of a camera, and what a photograph's file says: size, exposure, settings.

Source: Exif 2.32, tables 4 and 7.
"""

import io
import math
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from PIL import Image

from tbcad.cad.formats.pictures import PICTURE_SUFFIXES, RAW_SUFFIXES
from tbcad.cad.formats.pixels import TIFF_SIGNATURES
from tbcad.errors import InputError
from tbcad.records.run import Setting
from tbcad.rig.control.plan import CameraFault
from tbcad.rig.runs import decoded_image

NEAR = 1.5  # factor of exposure times: the coarsest cameras have steps of 2
_TIME = re.compile(r"(\d+(?:\.\d+)?)(?:/(\d+(?:\.\d+)?))?\s*s?$")
FORMATS = {"PNG": ".png", "TIFF": ".tif", "JPEG": ".jpg", "MPO": ".jpg"}
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
class Shot:
    """A photograph as the camera gives it."""

    data: bytes  # bytes of the image file, unchanged
    suffix: str  # of its name, in small letters, with the dot
    settings: dict[str, Setting]  # that the camera itself reports for it; the file may tell more


class RunCamera(Protocol):
    """A camera that is connected; what most need not do is done by default."""

    released: bool  # whether the controller's relay releases it

    def expose(self, seconds: float) -> None:
        """Set the exposure time of the photographs that follow."""

    def expect(self) -> None:
        """Get ready for a photograph: what was there before is none."""
        return

    def photograph(self) -> Shot:
        """Take a photograph, or wait for the one that was released."""

    def again(self) -> None:
        """Connect anew, after a fault."""
        return

    def close(self) -> None:
        """Give the camera up."""
        return


def shutter_seconds(text: str) -> float | None:
    """Exposure time of a camera's shutter setting, as 1/60 or 0.0100s; None: it says none."""
    match = _TIME.match(text)
    if match is None or float(match[2] or 1) == 0 or float(match[1]) == 0:
        return None
    return float(match[1]) / float(match[2] or 1)


def are_near(one: float, other: float) -> bool:
    """Whether two exposure times are the same but for a camera's steps."""
    return abs(math.log(one / other)) <= math.log(NEAR)


@dataclass(frozen=True)
class ImageFacts:
    """What a photograph's file says."""

    width_px: int
    height_px: int
    model: str  # of the camera; empty if the file does not say
    exposure_s: float | None  # exposure time; None if the file does not say
    settings: dict[str, Setting]  # that must not change in a run, as far as the file says them


def image_facts(data: bytes, suffix: str) -> ImageFacts:
    """Read all of an image file; CameraFault: of no kind that a run takes, or not complete."""
    if suffix not in PICTURE_SUFFIXES:
        raise CameraFault(
            f"the camera gives {suffix or 'nameless'} files: set its image format to JPEG, TIFF, "
            "PNG or raw"
        )
    try:
        height, width = decoded_image(data, f"photograph{suffix}").shape[:2]
    except InputError as error:
        raise CameraFault(str(error)) from None
    kind, tags, inner = _kind_and_tags(data)
    if suffix not in RAW_SUFFIXES and FORMATS.get(kind) != SAME_FORMAT.get(suffix, suffix):
        raise CameraFault(f"the photograph is a {kind} file and is called {suffix}")
    told = {name: _setting(inner.get(tag)) for tag, name in LOCKED.items()}
    exposure = told[LOCKED[EXPOSURE]]
    return ImageFacts(
        width_px=width,
        height_px=height,
        model=" ".join(str(tags[tag]).strip("\0 ") for tag in (MAKE, MODEL) if tag in tags),
        exposure_s=float(exposure) if exposure and not isinstance(exposure, str) else None,
        settings={name: value for name, value in told.items() if value is not None},
    )


def _kind_and_tags(data: bytes) -> tuple[str, Mapping[int, Any], Mapping[int, Any]]:
    """Format of an image, its tags and those of Exif: none where they cannot be read."""
    kind, tags = "TIFF" if data.startswith(TIFF_SIGNATURES) else "", Image.Exif()
    try:
        if kind:  # raw files too, and kinds that Pillow does not open
            tags.load(data)
        else:
            with Image.open(io.BytesIO(data)) as image:
                kind, tags = image.format or "", image.getexif()
        return kind, tags, tags.get_ifd(EXIF)
    except (OSError, ValueError, SyntaxError, struct.error):
        return kind, {}, {}


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
