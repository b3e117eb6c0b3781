"""From what a photograph's file holds to light: its encoding, exposure and vignetting."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.optics.lens_camera import LensCamera, vignetting
from tbcad.options.machines import MergeOptions
from tbcad.runs.images import Image16, read_image
from tbcad.srgb import srgb, srgb_light
from tbcad.types import Bytes, Floats, Ints

Encoding = Literal["linear", "srgb"]
Singles = NDArray[np.float32]

WHITE = 255.0
# Of a flat field: what counts as its full light, and the least light that can be corrected.
FULL_LIGHT, LEAST_LIGHT = 0.99, 0.02


@dataclass(frozen=True)
class Corrections:
    """Corrections of all photographs of a run.

    Attributes:
        encoding: of the photographs.
        gain: factor of each pixel's light, (h, w, 3) or (h, w, 1); None for one.
        brightness: factor of all.
    """

    encoding: Encoding
    gain: Singles | None
    brightness: float

    def light(self, image: Image16, pixel: Ints) -> Singles:
        """Light (..., 3) in columns and rows (..., 2), 0 to 255 where nothing is corrected."""
        values = image[pixel[..., 1], pixel[..., 0]]
        return _table(image.dtype, self.encoding)[values]

    def corrected(self, light: Singles, pixel: Ints, factor: float) -> Singles:
        """Light after flat field and brightness, (..., 3)."""
        result = light * np.float32(factor * self.brightness)
        if self.gain is not None:
            result = result * self.gain[pixel[..., 1], pixel[..., 0]]
        return np.asarray(result, dtype=np.float32)

    def encoded(self, light: Floats) -> Bytes:
        """Light (..., 3) as bytes of a picture."""
        clipped = np.clip(light, 0, WHITE)
        values = clipped if self.encoding == "linear" else WHITE * srgb(clipped / WHITE)
        return np.asarray(np.rint(values), dtype=np.uint8)


def corrections(options: MergeOptions, camera: LensCamera) -> Corrections:
    """Prepare the corrections of a camera's photographs.

    Raises:
        InputError: a flat field cannot be used.
    """
    gain = None
    if options.flat:
        gain = flat_field_gain(options.flat, options.encoding, camera)
    elif options.vignetting == "cos4":
        gain = cos4_gain(camera)
    return Corrections(options.encoding, gain, options.brightness)


def cos4_gain(camera: LensCamera) -> Singles:
    """What makes good the loss of light by the fourth power of the cosine, (h, w, 1)."""
    rows, gain = np.arange(camera.height_px), np.empty((camera.height_px, camera.width_px, 1))
    columns = np.arange(camera.width_px)
    for row in rows:
        pixels = np.stack(np.broadcast_arrays(columns, row), axis=-1).astype(np.float64)
        gain[row, :, 0] = 1 / vignetting(camera, camera.directions(pixels))
    return gain.astype(np.float32)


def flat_field_gain(files: Sequence[Path | str], encoding: Encoding, camera: LensCamera) -> Singles:
    """What makes the mean of photographs of an even surface even, (h, w, 3).

    Pixels with next to no light, beyond the lens's picture, show nothing.

    Raises:
        InputError: one cannot be read, has another size, or all is dark.
    """
    size = camera.height_px, camera.width_px
    total = np.zeros((*size, 3), dtype=np.float32)
    for file in files:
        image = read_image(Path(file))
        if image.shape[:2] != size:
            raise InputError(
                f"{file} is {image.shape[1]} x {image.shape[0]} pixels, the run's photographs are "
                f"{size[1]} x {size[0]}: photograph the flat field with the same camera"
            )
        total += _table(image.dtype, encoding)[image]
    full = np.quantile(total, FULL_LIGHT, axis=(0, 1))
    if (full <= 0).any():
        raise InputError(f"{files[0]} is dark: photograph an evenly lit surface")
    share = total / full
    lit = share > LEAST_LIGHT
    return np.where(lit, 1 / np.where(lit, share, 1), 0).astype(np.float32)


def _table(kind: np.dtype[np.uint8] | np.dtype[np.uint16], encoding: Encoding) -> Singles:
    """Light, 0 to 255, of each number that a pixel may have."""
    largest = np.iinfo(kind).max
    share = np.arange(largest + 1) / largest
    light = share if encoding == "linear" else srgb_light(share)
    return np.asarray(WHITE * light, dtype=np.float32)
