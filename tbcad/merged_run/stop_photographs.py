"""The photographs of one run's stops, corrected, each read when it is needed."""

from dataclasses import dataclass, field

import numpy as np

from tbcad.errors import InputError
from tbcad.merged_run.corrections import Corrections
from tbcad.records.exposure import DARK, DARK_LIT, LIT, Exposure, Frame, dark_factor, exposure_name
from tbcad.runs.images import Image16
from tbcad.runs.photographs import Run, read_photograph
from tbcad.simulate.prototype.ball_rays import between_pixels
from tbcad.types import Bytes, Floats


@dataclass(frozen=True)
class CorrectedPhotographs:
    """What the photographs of one run of the base show.

    Attributes:
        run: the folder.
        frames: of each stop; None where the run or the machine has none.
        corrections: of all photographs.
        exposure_s: to which exposure times are brought; None where they are unknown.
        missing: for each stop without a photograph, from 0, why; filled as they are read.
        without_dark: names of photographs whose dark one is missing or exposed too short to be
            subtracted; filled as they are read.
        dark_scaled: names of those whose dark one had another exposure, and was scaled; likewise.
    """

    run: Run
    frames: tuple[Frame | None, ...]
    corrections: Corrections
    exposure_s: float | None
    missing: dict[int, str] = field(default_factory=dict)
    without_dark: list[str] = field(default_factory=list)
    dark_scaled: list[str] = field(default_factory=list)

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
            image, factor = dark
            light = light - np.float32(factor) * self.corrections.light(image, pixel)
        light = self.corrections.corrected(light, pixel, self._factor(lit))
        return self.corrections.encoded(np.einsum("nk,nkc->nc", weight, light))

    def _exposure(self, frame: Frame, phase: str) -> Exposure:
        found = self.run.exposure(frame, phase)
        if found is None:
            name = exposure_name(frame, phase)
            raise InputError(self.run.faults.get(name, f"{name} was not photographed"))
        return found

    def _dark(self, frame: Frame, lit: Exposure) -> tuple[Image16, float] | None:
        """The photograph without light and its factor, if the run has such and it is usable."""
        if self.dark_phase not in self.run.record.phases:
            return None
        name = exposure_name(frame, LIT)
        try:
            dark = self._exposure(frame, self.dark_phase)
            image = read_photograph(self.run, dark)
        except InputError:
            self.without_dark.append(name)
            return None
        factor = dark_factor(dark.exposure_s, lit.exposure_s)
        if factor is None:
            self.without_dark.append(name)
            return None
        if factor != 1:
            self.dark_scaled.append(name)
        return image, factor

    def _factor(self, exposure: Exposure) -> float:
        """What brings a photograph to the exposure time of the others."""
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
