"""Raw files as cameras write them: an uncompressed mosaic in DNG 1.4 (Adobe, 2012)."""

import struct

import numpy as np
from numpy.typing import NDArray

ASCII, SHORT, LONG, RATIONAL, SRATIONAL, BYTE = 2, 3, 4, 5, 10, 1
RGGB = (0, 1, 1, 2)
SIZES = {BYTE: 1, ASCII: 1, SHORT: 2, LONG: 4, RATIONAL: 8, SRATIONAL: 8}


def dng(
    mosaic: NDArray[np.uint16],
    black: int = 0,
    white: int = 65_535,
    orientation: int = 1,
    as_shot: tuple[float, float, float] = (1, 1, 1),
) -> bytes:
    """A raw file of a mosaic (h, w): red in the first corner, two greens, blue."""
    height, width = mosaic.shape
    data, start = mosaic.astype("<u2").tobytes(), 1024
    identity = [number for k in range(9) for number in (int(k % 4 == 0), 1)]
    neutral = [number for one in as_shot for number in (round(one * 1000), 1000)]
    tags = [
        (254, LONG, [0]),
        (256, LONG, [width]),
        (257, LONG, [height]),
        (258, SHORT, [16]),
        (259, SHORT, [1]),
        (262, SHORT, [32803]),
        (271, ASCII, b"Maker\0"),
        (272, ASCII, b"Model\0"),
        (273, LONG, [start]),
        (274, SHORT, [orientation]),
        (277, SHORT, [1]),
        (278, LONG, [height]),
        (279, LONG, [len(data)]),
        (33421, SHORT, [2, 2]),
        (33422, BYTE, bytes(RGGB)),
        (50706, BYTE, bytes([1, 4, 0, 0])),
        (50708, ASCII, b"Maker Model\0"),
        (50714, LONG, [black]),
        (50717, LONG, [white]),
        (50721, SRATIONAL, identity),
        (50728, RATIONAL, neutral),
        (50778, SHORT, [21]),
    ]
    free = 8 + 2 + 12 * len(tags) + 4
    entries, further = b"", b""
    for tag, kind, values in tags:
        packed = values if isinstance(values, bytes) else _packed(kind, values)
        count = len(packed) // SIZES[kind]
        if len(packed) <= 4:
            entries += struct.pack("<HHI", tag, kind, count) + packed.ljust(4, b"\0")
        else:
            entries += struct.pack("<HHII", tag, kind, count, free + len(further))
            further += packed + b"\0" * (len(packed) % 2)
    head = struct.pack("<4sIH", b"II*\0", 8, len(tags)) + entries + bytes(4) + further
    return head.ljust(start, b"\0") + data


def _packed(kind: int, values: list[int]) -> bytes:
    return b"".join(struct.pack("<H" if kind == SHORT else "<i", value) for value in values)
