"""Pixels of pictures: what is taken of them by all readers, and those of TIFF.

TIFF (Adobe, TIFF 6.0, 1992): samples by tifffile, their meaning by the tags here.
"""

from io import BytesIO
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError

Picture: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]
"""Grey (h, w) or red, green, blue (h, w, 3)."""

MOST_PIXELS = 178_956_970  # as Pillow has it: more fill the memory rather than show anything
GIVE = "save it as PNG or TIFF, grey or RGB, of 8 or 16 bits"
TIFF_SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
# Without loss: none, LZW, deflate (both numbers), PackBits, LZMA, Zstandard.
_COMPRESSIONS = {1, 5, 8, 32946, 32773, 34925, 50000}
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE = 0, 1, 2, 3
_UNSIGNED, _FLOAT = 1, 3
_SMALL_OR_MASK = 1 | 4  # NewSubfileType: a preview, a mask
_UNSPECIFIED = 0  # a further sample that has no part in the colour


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


def tiff_picture(data: bytes, name: str, ignore_alpha: bool = False) -> Picture:
    """The picture in the bytes of a TIFF; arguments and errors as of `pictures.read_picture`."""
    import tifffile

    try:
        with tifffile.TiffFile(BytesIO(data)) as file:
            page = _only_page(file, name)
            _check(page, name, len(data))
            samples = page.asarray()
            return _picture(page, _channels_last(page, samples), name, ignore_alpha)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # its codecs raise errors of their own kinds
        if "imagecodecs" in str(error):
            raise InputError(
                f"{name} is compressed, which imagecodecs reads: pip install 'tbcad[machine]'"
            ) from None
        raise damaged(name, error) from None


def _only_page(file: Any, name: str) -> Any:
    pages = [page for page in file.pages if not page.subfiletype & _SMALL_OR_MASK]
    stack = int((file.imagej_metadata or {}).get("images", 1)) if file.is_imagej else 1
    count = max(len(pages), stack)
    if count != 1:
        raise InputError(f"{name} has {count} pictures in it: save the one that is meant alone")
    return pages[0]


def _check(page: Any, name: str, size: int) -> None:
    """Refuse what is not on the list, and a file that ends before its pixels do."""
    check_pixels(name, page.imagewidth, page.imagelength)
    kind = int(page.photometric)
    if kind not in {_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE}:
        colours = getattr(page.photometric, "name", kind)
        raise InputError(f"{name} has pixels of kind {colours}: {GIVE}")
    if int(page.compression) not in _COMPRESSIONS:
        raise InputError(
            f"{name} is compressed as {getattr(page.compression, 'name', page.compression)}: "
            "save it without, or with LZW or deflate"
        )
    whole = page.sampleformat == _UNSIGNED and page.bitspersample <= 16
    if not whole and page.sampleformat != _FLOAT:
        sign = "signed " if page.sampleformat == 2 else ""
        raise InputError(f"{name} has {sign}numbers of {page.bitspersample} bits: {GIVE}")
    ends = [at + n for at, n in zip(page.dataoffsets, page.databytecounts, strict=True)]
    if not ends or min(page.databytecounts) <= 0 or max(ends) > size:
        raise damaged(name, "its pixels end early")


def _channels_last(page: Any, samples: NDArray[Any]) -> NDArray[Any]:
    """Samples (h, w, n) of a picture, however they lie in the file."""
    if page.axes == "YX":
        return samples[..., None]
    if page.axes == "SYX":
        return np.moveaxis(samples, 0, 2)
    if page.axes == "YXS":
        return samples
    raise ValueError(f"its axes are {page.axes}")


def _picture(page: Any, samples: NDArray[Any], name: str, ignore_alpha: bool) -> Picture:
    kind, colours = int(page.photometric), 3 if int(page.photometric) == _RGB else 1
    further = tuple(int(extra) for extra in page.extrasamples)
    if samples.shape[2] != colours + len(further) or len(further) > 1:
        raise InputError(f"{name} has {samples.shape[2]} channels: {GIVE}")
    if further and kind == _PALETTE:
        raise InputError(f"{name} has a palette and {samples.shape[2]} channels: {GIVE}")
    largest = 1 if page.sampleformat == _FLOAT else (1 << page.bitspersample) - 1
    if further == (_UNSPECIFIED,):
        samples = samples[..., :colours]
    elif further:
        samples = without_alpha(samples, largest, name, ignore_alpha)
    pixels = samples[..., 0] if samples.ndim == 3 and samples.shape[2] == 1 else samples
    if kind == _PALETTE:
        return _by_palette(page, pixels)
    if page.sampleformat == _FLOAT:
        if kind == _WHITE_IS_ZERO:
            raise InputError(f"{name} has floating-point numbers, white is zero: {GIVE}")
        return as_light(pixels, name)
    return _full_scale(pixels, largest, kind == _WHITE_IS_ZERO)


def _full_scale(pixels: NDArray[Any], largest: int, white_is_zero: bool) -> Picture:
    """Numbers up to `largest` as shares of 255, or of 65535 where they have more than 8 bits."""
    kind: Any = np.uint8 if largest <= 255 else np.uint16
    full = np.iinfo(kind).max
    table = np.rint(np.arange(largest + 1) * (full / largest)).astype(kind)
    if white_is_zero:
        table = table[::-1]
    elif largest == full:
        return np.ascontiguousarray(pixels, dtype=kind)
    return np.asarray(table[pixels.astype(np.uint16)])  # of one bit they are booleans


def _by_palette(page: Any, pixels: NDArray[Any]) -> Picture:
    """Colours of the palette's numbers; in 8 bits where its 16 say no more."""
    colours = np.asarray(page.colormap, dtype=np.uint16).T  # (2^bits, 3)
    if colours.max() < 256:  # as some writers have it, and libtiff takes it
        return np.asarray(colours.astype(np.uint8)[pixels])
    high, low = colours >> 8, colours & 255
    if (low == 0).all() or (low == high).all():
        return np.asarray(high.astype(np.uint8)[pixels])
    return np.asarray(colours[pixels])
