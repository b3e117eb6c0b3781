"""Images as cameras and converters of raw pictures write them, with all their bits."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tbcad.errors import InputError

Image16 = NDArray[np.uint8] | NDArray[np.uint16]

_PNG, _PNG_DEPTH = b"\x89PNG\r\n\x1a\n", 24
_TIFF_BITS = 258  # tag BitsPerSample
_DEPTH = 16


def read_image(path: Path, again: str) -> Image16:
    """An image file, (h, w, 3), 8 or 16 bits a channel.

    Args:
        path: PNG, TIFF or JPEG.
        again: what to do where it cannot be read, for the error.

    Raises:
        InputError: it cannot be read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}: {again}") from None
    return decoded_image(path, data, again)


def decoded_image(path: Path, data: bytes, again: str) -> Image16:
    """The image in the bytes of a file; arguments and errors as of `read_image`."""
    try:
        with Image.open(BytesIO(data)) as image:
            pixels = _by_opencv(path, data) if _is_deep_colour(image, data) else np.asarray(image)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(f"{path} cannot be read: {error}: {again}") from None
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    if pixels.dtype == np.int32:  # as Pillow calls 16 bits of grey in some files
        pixels = pixels.astype(np.uint16)
    if pixels.dtype not in (np.uint8, np.uint16) or pixels.shape[2] < 3:
        raise InputError(f"{path} has no 8 or 16 bits of grey or colour: {again}")
    return np.asarray(pixels[..., :3])


def _is_deep_colour(image: Image.Image, data: bytes) -> bool:
    """Whether colours have 16 bits, of which Pillow would drop half."""
    if len(image.getbands()) == 1:
        return False
    if data.startswith(_PNG):
        return data[_PNG_DEPTH] == _DEPTH
    tags: Any = getattr(image, "tag_v2", {})
    return _DEPTH in np.atleast_1d(tags.get(_TIFF_BITS, 8))


def _by_opencv(path: Path, data: bytes) -> NDArray[Any]:
    try:
        import cv2
    except ImportError:
        raise InputError(
            f"{path} has 16 bits a colour, which only OpenCV reads: pip install 'tbcad[machine]'"
        ) from None
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise ValueError("damaged")
    return np.asarray(pixels[..., 2::-1])  # it gives blue first
