"""Pictures of light in OpenEXR's format, read by its library in a process of its own.

The library writes its complaints to both streams of the process, and damaged files have ended it.
"""

import os
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.images.pixels import as_light, check_pixels, damaged, import_of_machine
from tbcad.errors import InputError

SIGNATURE = b"\x76\x2f\x31\x01"
_NUMPY = b"\x93NUMPY"
GIVE = "save it as one picture of channels R, G and B"
# Chromaticities of red, green and blue of Rec. 709, which a file has that does not tell its own.
_REC_709, _ALIKE = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06), 0.011


def exr_picture(path: Path) -> NDArray[np.float32]:
    """Light (h, w, 3), or grey (h, w), of the display window; black where there are no data.

    InputError if it is damaged, or no flat picture of R, G and B, or Y.
    """
    words = [sys.executable, "-m", "tbcad.cad.formats.images.openexr", str(path)]
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
