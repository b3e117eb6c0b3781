"""The photographs of one run's stops, corrected, each read when it is needed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tbcad.common.figure_files import srgb, srgb_light
from tbcad.core.optics.camera import LensCamera, vignetting
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.ball_rays import between_pixels
from tbcad.options.machines import MergeOptions
from tbcad.options.shared import AnyPath
from tbcad.records.run import DARK, DARK_LIT, LIT, Exposure, Frame, exposure_name, same_exposure
from tbcad.rig.runs import Image16, Run, read_image, read_photograph
from tbcad.types import Bytes, Floats, Ints

Encoding = Literal["linear", "srgb"]
Singles = NDArray[np.float32]

WHITE = 255.0
# Of a flat field: what counts as its full light, and the least light that can be corrected.
FULL_LIGHT, LEAST_LIGHT = 0.99, 0.02


@dataclass(frozen=True)
class Corrections:
    """Corrections of all photographs of a run."""

    encoding: Encoding
    gain: Singles | None  # factor of each pixel's light, (h, w, 3) or (h, w, 1); None for one
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
    """Prepare the corrections of a camera's photographs."""
    gain = None
    if options.flat:
        gain = flat_field_gain(options.flat, options.encoding, camera)
    elif options.vignetting == "cos4":
        gain = cos4_gain(camera)
    return Corrections(options.encoding, gain, options.brightness)


def cos4_gain(camera: LensCamera) -> Singles:
    """Factors that correct vignetting by the fourth power of the cosine, (h, w, 1)."""
    rows, gain = np.arange(camera.height_px), np.empty((camera.height_px, camera.width_px, 1))
    columns = np.arange(camera.width_px)
    for row in rows:
        pixels = np.stack(np.broadcast_arrays(columns, row), axis=-1).astype(np.float64)
        gain[row, :, 0] = 1 / vignetting(camera, camera.directions(pixels))
    return gain.astype(np.float32)


def flat_field_gain(files: Sequence[AnyPath], encoding: Encoding, camera: LensCamera) -> Singles:
    """Factors that make the mean of photographs of an even surface even, (h, w, 3).

    Pixels with next to no light, beyond the lens's picture, show nothing.

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


@dataclass(frozen=True)
class CorrectedPhotographs:
    """Photographs of one run of the base."""

    run: Run
    frames: tuple[Frame | None, ...]  # of each stop; None where the run or the machine has none
    corrections: Corrections
    exposure_s: float | None  # to which exposure times are brought; None where they are unknown
    # for each stop without a photograph, from 0, why; filled as they are read
    missing: dict[int, str] = field(default_factory=dict)
    # names of photographs whose dark one is missing or exposed otherwise; filled as they are read
    without_dark: list[str] = field(default_factory=list)

    @property
    def dark_phase(self) -> str:
        """The phase that is subtracted: that with the exposure of the lit object, if there is."""
        return DARK_LIT if DARK_LIT in self.run.record.phases else DARK

    def colours(self, stop: int, places: Floats) -> Bytes | None:
        """Colours (n, 3) of a stop's photograph at columns and rows (n, 2), if there is one."""
        frame = self.frames[stop]
        if frame is None:
            self.missing.setdefault(stop, "the calibration has no angle of this stop")
            return None
        try:
            return self._shown(frame, places)
        except InputError as error:
            self.missing[stop] = str(error)
            return None

    def _shown(self, frame: Frame, places: Floats) -> Bytes:
        lit = self._exposure(frame, LIT)
        pixel, weight = between_pixels(places)
        last = np.array([self.run.record.width_px - 1, self.run.record.height_px - 1])
        pixel = np.minimum(pixel, last)
        light = self.corrections.light(read_photograph(self.run, lit), pixel)
        dark = self._dark(frame, lit)
        if dark is not None:
            light = light - self.corrections.light(dark, pixel)
        light = self.corrections.corrected(light, pixel, self._factor(lit))
        return self.corrections.encoded(np.einsum("nk,nkc->nc", weight, light))

    def _exposure(self, frame: Frame, phase: str) -> Exposure:
        found = self.run.exposure(frame, phase)
        if found is None:
            name = exposure_name(frame, phase)
            raise InputError(self.run.faults.get(name, f"{name} was not photographed"))
        return found

    def _dark(self, frame: Frame, lit: Exposure) -> Image16 | None:
        """The photograph without light, if the run has such and it is usable."""
        if self.dark_phase not in self.run.record.phases:
            return None
        try:
            dark = self._exposure(frame, self.dark_phase)
            if same_exposure(dark.exposure_s, lit.exposure_s):
                return read_photograph(self.run, dark)
        except InputError:
            pass
        self.without_dark.append(exposure_name(frame, LIT))
        return None

    def _factor(self, exposure: Exposure) -> float:
        if self.exposure_s is None or exposure.exposure_s is None:
            return 1.0
        return self.exposure_s / exposure.exposure_s


def common_exposure(run: Run) -> float | None:
    """Median exposure time of the photographs of the object, s; None where no one knows it."""
    times = [
        one.exposure_s
        for one in run.exposures.values()
        if one.phase == LIT and one.exposure_s is not None
    ]
    return float(np.median(times)) if times else None
