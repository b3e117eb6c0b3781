"""PNG files of photographs, 8 bits of grey or of red, green and blue, ten times as quick.

Photographs of single LEDs are black but for some spots: zlib's inflate takes 20 ms for each of 3.2
million pixels, that of libdeflate one. What is not as plain as that is left to others (PNG, ISO/IEC
15948:2004).
"""

import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.pixels import MOST_PIXELS, import_of_machine
from tbcad.common.compiled import compiled
from tbcad.errors import InputError
from tbcad.types import Bytes

SIGNATURE = b"\x89PNG\r\n\x1a\n"
CHANNELS = {b"\x08\0\0\0\0": 1, b"\x08\x02\0\0\0": 3}  # by depth, colour, methods, interlace
SUB, UP, MEAN, PAETH = 1, 2, 3, 4
PLAIN = {b"IHDR", b"IDAT", b"IEND"}  # others may change what pixels mean


def plain_png(data: bytes) -> Bytes | None:
    """The picture in the bytes of a file, (h, w) or (h, w, 3); None: it is not plain, or whole."""
    if not data.startswith(SIGNATURE):
        return None
    found = list(_chunks(data))
    if {kind for kind, _ in found} != PLAIN or found[-1][0] != b"IEND":
        return None
    head = found[0][1]
    width, height = (int.from_bytes(head[at : at + 4], "big") for at in (0, 4))
    channels = CHANNELS.get(head[8:])
    if channels is None or not 0 < width * height <= MOST_PIXELS:
        return None
    size = height * (1 + channels * width)
    rows = _inflated(b"".join(content for kind, content in found if kind == b"IDAT"), size)
    pixels = np.empty((height, channels * width), dtype=np.uint8)
    if rows is None or not unfiltered(rows.reshape(height, -1), channels, pixels):
        return None
    return pixels.reshape((height, width, channels) if channels > 1 else (height, width))


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kinds and contents, until the first one that is damaged."""
    at = len(SIGNATURE)
    while at + 12 <= len(data):
        end = at + 8 + int.from_bytes(data[at : at + 4], "big")
        if zlib.crc32(data[at + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            return
        yield data[at + 4 : at + 8], data[at + 8 : end]
        at = end + 4


def _inflated(data: bytes, size: int) -> NDArray[np.uint8] | None:
    """So many bytes of a stream of zlib's; None: it has others, or the codec is not installed."""
    try:
        codecs: Any = import_of_machine("imagecodecs", "")
        found = codecs.deflate_decode(data, out=size)
    except (InputError, RuntimeError, ValueError):
        return None
    return np.frombuffer(found, dtype=np.uint8) if len(found) == size else None


@compiled
def unfiltered(rows: Bytes, step: int, pixels: Bytes) -> bool:
    """Fill pixels (h, w) from filtered rows (h, 1 + w); False: a filter does not exist.

    A row's first number is its filter; `step` is the distance to the same colour on the left.
    """
    for r in range(len(rows)):
        kind, own, above = rows[r, 0], pixels[r], pixels[max(r - 1, 0)]
        if kind > PAETH:
            return False
        own[:] = rows[r, 1:]
        if kind == 0:
            continue
        for i in range(len(own)):
            left = int(own[i - step]) if i >= step else 0
            up = int(above[i]) if r else 0
            if kind == SUB:
                by = left
            elif kind == UP:
                by = up
            elif kind == MEAN:
                by = (left + up) // 2
            else:
                corner = int(above[i - step]) if r and i >= step else 0
                a, b, c = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
                by = left if a <= b and a <= c else up if b <= c else corner
            own[i] = np.uint8((int(own[i]) + by) & 255)
    return True
