"""The one reader of pictures: photographs, flat fields, textures, pictures of light.

Numbers are those of the file: a share of full scale, which is 255, 65535 or, in floating point, 1.
Whether that share is proportional to light or encoded as sRGB is for the caller to know. Not
applied are colour profiles and PNG's gamma (they would change numbers that options explain), and
Exif's orientation (a lens is calibrated in the pixels of the sensor). A picture of which no grey or
red, green and blue can be had exactly is refused by name.
"""

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from tbcad.cad.formats.pixels import (
    GIVE,
    TIFF_SIGNATURES,
    Picture,
    as_light,
    check_pixels,
    damaged,
    import_of_machine,
    tiff_picture,
    transparent,
    without_alpha,
)
from tbcad.errors import InputError

RAW_SUFFIXES = (
    *(".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dcr", ".dng", ".erf", ".iiq", ".kdc", ".mef"),
    *(".mos", ".mrw", ".nef", ".nrw", ".orf", ".pef", ".raf", ".raw", ".rw2", ".rwl", ".sr2"),
    *(".srf", ".srw", ".x3f"),
)
__all__ = ["PICTURE_SUFFIXES", "Picture", "decoded", "picture_of", "read_picture", "visible_files"]
PICTURE_SUFFIXES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", *RAW_SUFFIXES)
"""Files that are looked for in a folder of photographs."""
FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "GIF")  # beside TIFF and raw files
_AS_THEY_ARE = ("L", "RGB", "I;16", "I;16B", "I;16L", "I;16N")
_WITH_ALPHA = {"LA": "LA", "La": "LA", "RGBA": "RGBA", "RGBa": "RGBA", "P": "RGBA", "PA": "RGBA"}
_PNG, _PNG_DEPTH, _PNG_COLOUR = b"\x89PNG\r\n\x1a\n", 24, 25  # places of its header's bytes
_JPEG_SCAN, _JPEG_END = 0xDA, b"\xff\xd9"


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


def read_picture(path: Path) -> Picture:
    """The picture in a file: (h, w) or (h, w, 3) of uint8, uint16 or float32.

    PNG, TIFF, JPEG, WebP, BMP, GIF, or a camera's raw file; InputError if it cannot be read exactly
    as grey or RGB.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}: name another") from None
    return picture_of(data, str(path))


def picture_of(data: bytes, name: str, ignore_alpha: bool = False) -> Picture:
    """The picture in the bytes of a file of this name; else as `read_picture`."""
    if Path(name).suffix.lower() in RAW_SUFFIXES:
        return raw_picture(data, name)
    if data.startswith(TIFF_SIGNATURES):
        return tiff_picture(data, name, ignore_alpha)
    try:
        with Image.open(BytesIO(data), formats=FORMATS) as image:
            return decoded(image, name, data, ignore_alpha)
    except UnidentifiedImageError:
        raise InputError(f"{name} is no TIFF, {', '.join(FORMATS)} or damaged: {GIVE}") from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise damaged(name, error) from None


def decoded(
    image: Image.Image, name: str, data: bytes = b"", ignore_alpha: bool = False
) -> Picture:
    """The picture of an image that Pillow has opened, of a file's bytes; else as `read_picture`."""
    frames = getattr(image, "n_frames", 1)
    if frames > 1 and image.format != "MPO":  # a photograph, with previews after it
        raise InputError(f"{name} has {frames} pictures in it: save the one that is meant alone")
    deep = data.startswith(_PNG) and data[_PNG_DEPTH] == 16 and data[_PNG_COLOUR] > 0
    try:
        image.load()
        if data.startswith(b"\xff\xd8") and not _is_whole_jpeg(data):
            raise OSError("its end is missing")
    except (OSError, ValueError, SyntaxError) as error:
        raise damaged(name, error) from None
    if deep:
        return _deep_png(data, name, ignore_alpha)
    return _converted(image, name, ignore_alpha)


def visible_files(folder: Path, suffixes: Iterable[str] = PICTURE_SUFFIXES) -> list[Path]:
    """Files of a folder by name that have one of some suffixes and are not hidden (".name")."""
    allowed = set(suffixes)
    return sorted(
        file
        for file in folder.iterdir()
        if file.suffix.lower() in allowed and not file.name.startswith(".")
    )


def _is_whole_jpeg(data: bytes) -> bool:
    """Whether the end of the first picture is there: libjpeg fills up what is missing with grey."""
    at = 2
    while at + 4 <= len(data):
        if data[at + 1] == _JPEG_SCAN:
            return _JPEG_END in data[at:]
        filler = data[at] != 0xFF or data[at + 1] == 0xFF
        at += 1 if filler else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return False


def _deep_png(data: bytes, name: str, ignore_alpha: bool) -> Picture:
    """Colours or grey with alpha of 16 bits, of which Pillow keeps half."""
    codecs = import_of_machine("imagecodecs", name)
    pixels = codecs.png_decode(data)
    if pixels.ndim == 3 and pixels.shape[2] in {2, 4}:
        pixels = without_alpha(pixels, 65_535, name, ignore_alpha)
    return np.asarray(pixels, dtype=np.uint16)


def _converted(image: Image.Image, name: str, ignore_alpha: bool) -> Picture:
    mode = image.mode
    if mode in _WITH_ALPHA:
        pixels = np.asarray(image.convert(_WITH_ALPHA[mode]))
        return without_alpha(pixels, 255, name, ignore_alpha)
    if not ignore_alpha and _has_transparent_colour(image):
        raise transparent(name)
    if mode == "1":
        return np.asarray(image.convert("L"))
    if mode == "RGBX":
        return np.asarray(image)[..., :3]
    if mode == "F":
        return as_light(np.asarray(image), name)
    if mode not in _AS_THEY_ARE:
        raise InputError(f"{name} has pixels of kind {mode}: {GIVE}")
    pixels = np.asarray(image)
    return pixels.astype(pixels.dtype.newbyteorder("="), copy=False)


def _has_transparent_colour(image: Image.Image) -> bool:
    """Whether pixels have the one colour that a PNG may declare transparent."""
    key: Any = image.info.get("transparency")
    if key is None:
        return False
    if image.mode == "I;16":
        return bool((np.asarray(image) == key).any())
    return bool(np.asarray(image.convert("RGBA"))[..., 3].min() < 255)
