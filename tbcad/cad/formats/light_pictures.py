"""Pictures of light: Radiance's (.hdr), and OpenEXR's, read in a process of its own.

Radiance has shared exponents, as they are or in runs (G. Ward, Real Pixels, Graphics Gems II, 1991;
Radiance, File Formats, "Picture (.hdr)"). OpenEXR's library writes its complaints to both streams
of the process, and damaged files have ended it.
"""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.pixels import as_light, check_pixels, damaged, import_of_machine
from tbcad.errors import InputError
from tbcad.types import Bytes, Floats

HDR_SIGNATURE = b"#?"
OLD_RUNS = "it has runs of before 1991"
HDR_FORMAT = "32-bit_rle_rgbe"
EXPONENT = 128 + 8  # bias, and bits of a mantissa
RUN_WIDTHS = range(8, 32_768)  # of scanlines that may have runs
# Chromaticities of red, green and blue: those of Radiance; BT.709's are as near as eyes see.
PRIMARIES = (0.640, 0.330, 0.290, 0.600, 0.150, 0.060)
PRIMARIES_ALIKE = 0.011
_RESOLUTION = re.compile(rb"([-+][XY]) +(\d{1,9}) +([-+][XY]) +(\d{1,9})\n")
EXR_SIGNATURE = b"\x76\x2f\x31\x01"
_NUMPY = b"\x93NUMPY"
GIVE = "save it as one picture of channels R, G and B"
# Chromaticities of red, green and blue of Rec. 709, which a file has that does not tell its own.
_REC_709, _ALIKE = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06), 0.011


def hdr_picture(data: bytes, name: str) -> Floats:
    """Red, green and blue (h, w, 3), linear, before EXPOSURE and COLORCORR; the top row first.

    InputError if it ends early, is damaged, has other primaries, or its scanlines another order.
    """
    end = data.find(b"\n\n")
    resolution = _RESOLUTION.match(data, end + 2) if end >= 0 else None
    if not data.startswith(HDR_SIGNATURE) or resolution is None:
        raise damaged(name, "it has no header of Radiance's format")
    values: dict[str, list[str]] = {}
    for line in data[:end].decode("latin-1").splitlines():
        key, equals, value = line.partition("=")
        if equals:
            values.setdefault(key, []).append(value.strip())
    kind = values.get("FORMAT", [HDR_FORMAT])[-1]
    if kind != HDR_FORMAT:
        raise InputError(f"{name} is of format {kind}, allowed is {HDR_FORMAT}: convert it")
    if resolution[1] + resolution[3] != b"-Y+X":
        raise InputError(f"{name} has scanlines in another order than -Y +X: turn it with pflip")
    _check_primaries(values.get("PRIMARIES", []), name)
    shape = int(resolution[2]), int(resolution[4])
    check_pixels(name, *shape)
    try:
        pixels = np.stack(list(_scanlines(data, resolution.end(), *shape)))
    except (IndexError, ValueError) as error:
        if str(error) == OLD_RUNS:
            raise InputError(f"{name}: {error}: save it again with a program of today") from None
        reason = "it ends early" if isinstance(error, IndexError) else error
        raise damaged(name, reason) from None
    light = pixels[..., :3] * np.ldexp(1.0, pixels[..., 3:].astype(np.int64) - EXPONENT)
    light[pixels[..., 3] == 0] = 0
    return np.asarray(light * _scale(values, name))


def _scale(values: dict[str, list[str]], name: str) -> Floats:
    """What undoes all exposures and colour corrections that a file was multiplied by, (3,)."""
    done = np.ones(3)
    for key, count in (("EXPOSURE", 1), ("COLORCORR", 3)):
        for text in values.get(key, []):
            factor = _numbers(text, key, name)
            if len(factor) != count or not (np.isfinite(factor) & (factor > 0)).all():
                raise damaged(name, f"{key}={text}")
            done = done * factor
    return 1 / done


def _check_primaries(texts: list[str], name: str) -> None:
    for text in texts:
        found = _numbers(text, "PRIMARIES", name)
        if len(found) != 8 or np.abs(found[:6] - PRIMARIES).max() > PRIMARIES_ALIKE:
            raise InputError(
                f"{name} has PRIMARIES={text}, other colours than those of Rec. 709: convert it, "
                "for instance with Radiance's ra_xyze -r"
            )


def _numbers(text: str, key: str, name: str) -> Floats:
    try:
        return np.array([float(word) for word in text.split()])
    except ValueError:
        raise damaged(name, f"{key}={text}") from None


def _scanlines(data: bytes, at: int, lines: int, width: int) -> Iterator[Bytes]:
    """Bytes (w, 4) of each scanline; IndexError where data end early, ValueError where damaged."""
    for _ in range(lines):
        if width in RUN_WIDTHS and data[at : at + 2] == b"\2\2" and data[at + 2] < 128:
            if int.from_bytes(data[at + 2 : at + 4], "big") != width:
                raise ValueError("a scanline has another width")
            line, at = _runs(data, at + 4, width)
        else:
            line = np.frombuffer(data[at : at + 4 * width], np.uint8).reshape(-1, 4)
            if (line[:, :3] == 1).all(axis=1).any():
                raise ValueError(OLD_RUNS)
            if len(line) < width:
                raise IndexError
            at += 4 * width
        yield line


def _runs(data: bytes, at: int, width: int) -> tuple[Bytes, int]:
    """A scanline (w, 4) of four channels in runs, and where the next begins."""
    line = bytearray()
    for end in range(width, 5 * width, width):
        while len(line) < end:
            count = data[at]
            if count > 128:
                line += data[at + 1 : at + 2] * (count - 128)
                at += 2
            else:
                line += data[at + 1 : at + 1 + count]
                at += 1 + count
            if count == 0 or len(line) > end:
                raise ValueError("a run does not fit its scanline")
    return np.frombuffer(line, np.uint8).reshape(4, width).T, at


def exr_picture(path: Path) -> NDArray[np.float32]:
    """Light (h, w, 3), or grey (h, w), of the display window; black where there are no data.

    InputError if it is damaged, or no flat picture of R, G and B, or Y.
    """
    words = [sys.executable, "-m", "tbcad.cad.formats.light_pictures", str(path)]
    done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    if done.stdout.startswith(_NUMPY):
        return np.asarray(np.load(BytesIO(done.stdout)))
    if done.returncode == 0:
        raise InputError(done.stdout.decode())
    raise damaged(str(path), f"its reader ended with {done.returncode}")


def _read(path: str) -> NDArray[np.float32]:
    library = import_of_machine("OpenEXR", path)
    try:
        with library.File(path, separate_channels=True, header_only=True) as file:
            count, header = len(file.parts), dict(file.header() if file.parts else {})
        if count == 1:
            data, display = _windows(header, path)
            _check_header(library, header, path)
        elif count:
            raise InputError(f"{path} has {count} parts: {GIVE}")
        with library.File(path, separate_channels=True) as file:
            light = _colours(file.channels(), path)
    except (RuntimeError, ValueError, OSError) as error:
        raise damaged(path, error) from None
    return _shown(light, data, display)


def _windows(header: Any, name: str) -> tuple[Any, Any]:
    """Data and display window: first and last column and row, (2, 2) each."""
    windows = [np.array(header[key], dtype=np.int64) for key in ("dataWindow", "displayWindow")]
    for first, last in windows:
        width, height = last - first + 1
        check_pixels(name, int(width), int(height))
    return windows[0], windows[1]


def _check_header(library: Any, header: Any, name: str) -> None:
    if header["type"] in {library.deepscanline, library.deeptile}:
        raise InputError(f"{name} is deep, several depths in each pixel: {GIVE}")
    if header.get("envmap") == library.ENVMAP_CUBE:
        raise InputError(f"{name} is a cube map in OpenEXR's own order: convert it to latlong")
    colours = header.get("chromaticities", _REC_709)
    if np.abs(np.ravel(colours)[:6] - _REC_709).max() > _ALIKE:
        raise InputError(f"{name} has other colours than those of Rec. 709: convert it to them")


def _colours(channels: Any, name: str) -> NDArray[np.float32]:
    """Light (h, w, 3) or (h, w) of the channels that have it."""
    if {"Y", "RY", "BY"} <= set(channels):
        raise InputError(f"{name} has luminance and chroma: {GIVE}")
    wanted = next((one for one in ("RGB", "Y") if set(one) <= set(channels)), "")
    if not wanted:
        raise InputError(f"{name} has channels {', '.join(sorted(channels))}: {GIVE}")
    chosen = [channels[one] for one in wanted]
    if any((one.xSampling, one.ySampling) != (1, 1) for one in chosen):
        raise InputError(f"{name} has channels of fewer pixels: {GIVE}")
    pixels = [one.pixels for one in chosen]
    return as_light(np.stack(pixels, axis=-1) if len(pixels) > 1 else pixels[0], name)


def _shown(light: NDArray[np.float32], data: Any, display: Any) -> NDArray[np.float32]:
    """The part of light in the data window that the display window shows."""
    (width, height), (left, top) = display[1] - display[0] + 1, data[0] - display[0]
    shown = np.zeros((height, width, *light.shape[2:]), dtype=np.float32)
    x0, y0 = max(left, 0), max(top, 0)
    part = light[y0 - top : max(height - top, 0), x0 - left : max(width - left, 0)]
    shown[y0 : y0 + part.shape[0], x0 : x0 + part.shape[1]] = part
    return shown


def _main() -> None:
    """Write the picture of the file that is named, or in one line why not, to standard output."""
    result = BytesIO()
    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)  # where the library's own words go
        try:
            np.save(result, _read(sys.argv[1]))
        except InputError as error:
            result.write(str(error).encode())
        output.write(result.getvalue())


if __name__ == "__main__":
    _main()
