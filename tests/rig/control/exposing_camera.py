"""A camera of the user's own: what is before it, exposed for some seconds, as a PNG file.

python exposing_camera.py RADIANCE SECONDS OUTPUT: a NumPy file of what fills a pixel in a second.
It is started for each photograph, so it loads little.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from tests.rig.control.grbl_double import Machine

SIZE = (416, 310)  # of the export's camera
LED, OBJECT = 80.0, 0.4  # of a full pixel in a second: an LED is far brighter than what is lit
ROWS = range(40, 240, 40)


def radiance(machine: Machine) -> bytes:
    """What lights make to be seen: the object, or each LED in five balls."""
    pixels = np.zeros(SIZE[::-1], np.float32)
    for light in machine.lights:
        if light == 0:
            pixels[100:200, 100:300] = OBJECT
        for row in ROWS if light else ():
            pixels[row : row + 4, 60 * light : 60 * light + 4] = LED
    file = io.BytesIO()
    np.save(file, pixels)
    return file.getvalue()


def main(scene: str, seconds: str, output: str) -> None:
    numbers = np.clip(np.rint(255 * float(seconds) * np.load(scene)), 0, 255)
    Image.fromarray(numbers.astype(np.uint8)).save(Path(f"{output}.png"))


if __name__ == "__main__":
    main(*sys.argv[1:])
