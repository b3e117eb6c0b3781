"""One stop photographed under each light before a run: saturated, too dark, or good.

Highlights count as the calibration counts them: bright spots that lie above the dark photograph by
2 % of the largest number. A saturated photograph does not tell by how much, so where the camera
takes an exposure time, others are tried.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.ndimage import label, maximum

from tbcad.control.cameras.camera import Shot
from tbcad.errors import InputError
from tbcad.runs.exposure import DARK, DARK_LIT, LIT
from tbcad.runs.images import Image16, decoded_image
from tbcad.types import Bools, Floats, Progress

GOOD, SATURATED, TOO_DARK, STRAY = "good", "saturated", "too dark", "not dark"
State = Literal["good", "saturated", "too dark", "not dark"]
THRESHOLD = 0.02  # of the largest number: less is no light, as of spots in a calibration
FULL = 0.99  # likewise: more is saturated, also in a JPEG file
MOST_SATURATED = {"leds": 0.1, LIT: 0.05}  # share of the highlights, and of the lit pixels
LEAST_PEAK = 0.15  # of the largest number: below, noise and rounding decide
LEAST_PIXELS = 2  # of a highlight
LEAST_LIT = 1e-3  # share of the pixels
MOST_STRAY = 0.25  # level that a hundredth of a dark photograph may exceed
TARGET = 0.75  # level of the brightest where the exposure is right
BRIGHTEST = {"leds": 0.9, LIT: 0.99}  # quantile that counts as the brightest
STEP, MOST_STEPS = 8.0, 6  # factor between exposures that are tried, and number of them

Shoot = Callable[[str, float | None], Shot]
"""Takes the photograph of a phase with an exposure time; None: that which the camera has."""


@dataclass(frozen=True)
class Seen:
    """What a photograph shows.

    Attributes:
        state: what to think of it.
        peak: level of its brightest light, of the largest number.
        saturated: share of the highlights, or of the lit pixels, that are.
        highlights: number of them; None where no single LED shines.
    """

    state: State
    peak: float
    saturated: float
    highlights: int | None = None

    @property
    def factor(self) -> float:
        """Of the exposure that would be right; where nothing tells it, one that is worth a try."""
        if self.state == SATURATED:
            return 1 / STEP
        return TARGET / self.peak if self.peak > THRESHOLD else STEP

    @property
    def text(self) -> str:
        """In words."""
        what = "the light" if self.highlights is None else f"{self.highlights} highlights"
        seen = (
            f"peak {self.peak:.0%} of the largest number, {self.saturated:.0%} of {what} saturated"
        )
        if self.state in (GOOD, STRAY):
            return f"{self.state}: {seen}"
        how = "or less" if self.state == SATURATED else "or so"
        return f"{self.state}: {seen}: {self.factor:.2g} times the exposure {how} would be right"


def preflight(times: dict[str, float | None], shoot: Shoot, where: str, note: Progress) -> None:
    """Photograph one stop under each light, and say what is wrong.

    Args:
        times: exposure time of each phase, s; None: that which the camera has.
        shoot: takes a photograph.
        where: the camera and the stop in words.
        note: called with a line for each phase.

    Raises:
        InputError: an exposure will not do; it says which would.
    """
    dark: dict[str, Image16] = {}
    seen: dict[str, Seen] = {}
    for phase, seconds in times.items():
        image = _image(phase, shoot(phase, seconds))
        if phase in (DARK, DARK_LIT):
            dark[phase] = image
        seen[phase] = look(phase, image, _dark_of(phase, dark))
        exposure = "" if seconds is None else f" at {seconds:g} s"
        note(f"preflight, {where}: {phase}{exposure} is {seen[phase].text}")
    wrong = [phase for phase, one in seen.items() if one.state != GOOD]
    if wrong:
        right = {phase: _right(phase, times[phase], seen[phase], shoot) for phase in _worst(seen)}
        raise InputError(_refusal(seen, wrong, right, times))


def look(phase: str, image: Image16, dark: Image16 | None) -> Seen:
    """Judge the photograph (h, w, 3) of a phase, less the dark one with its exposure, if given."""
    level = _level(image)
    if phase in (DARK, DARK_LIT):
        peak = float(np.quantile(level, 0.99))
        return Seen(STRAY if peak > MOST_STRAY else GOOD, peak, float((level >= FULL).mean()))
    bright = (level if dark is None else level - _level(dark)) > THRESHOLD
    if phase == LIT:
        enough = bright.mean() >= LEAST_LIT
        return _judged(level[bright] if enough else np.zeros(0), LIT)
    return _judged(_peaks(level, bright), "leds")


def _image(phase: str, shot: Shot) -> Image16:
    return decoded_image(Path(f"{phase}{shot.suffix}"), shot.data, "see to the camera")


def _level(image: Image16) -> Floats:
    """Largest colour of each pixel, of the largest number, (h, w)."""
    return np.asarray(image.max(axis=2) / np.iinfo(image.dtype).max)


def _peaks(level: Floats, bright: Bools) -> Floats:
    """Largest level of each highlight, (n,)."""
    spots, _ = label(bright, np.ones((3, 3)))
    sizes = np.bincount(spots.ravel())
    large = 1 + np.flatnonzero(sizes[1:] >= LEAST_PIXELS)
    return np.asarray(maximum(level, spots, large), dtype=np.float64)


def _judged(levels: Floats, kind: str) -> Seen:
    number = None if kind == LIT else len(levels)
    if not len(levels):
        return Seen(TOO_DARK, 0.0, 0.0, number)
    peak, saturated = float(np.quantile(levels, BRIGHTEST[kind])), float((levels >= FULL).mean())
    if saturated > MOST_SATURATED[kind]:
        return Seen(SATURATED, peak, saturated, number)
    return Seen(GOOD if peak >= LEAST_PEAK else TOO_DARK, peak, saturated, number)


def _dark_of(phase: str, dark: dict[str, Image16]) -> Image16 | None:
    return dark.get(DARK_LIT, dark.get(DARK)) if phase == LIT else dark.get(DARK)


def _worst(seen: dict[str, Seen]) -> list[str]:
    """The LED and the lit object whose exposure is farthest from right, if not right."""
    wrong = [phase for phase, one in seen.items() if one.state in (SATURATED, TOO_DARK)]
    leds = sorted(
        (p for p in wrong if p != LIT), key=lambda p: (seen[p].factor, -seen[p].saturated)
    )
    return leds[:1] + [phase for phase in wrong if phase == LIT]


def _right(phase: str, seconds: float | None, seen: Seen, shoot: Shoot) -> float | None:
    """Exposure time that is right for a phase, found by trying; None: not found."""
    if seconds is None:
        return None
    for _ in range(MOST_STEPS):
        seconds *= seen.factor
        try:
            seen = look(phase, _image(phase, shoot(phase, seconds)), None)
        except InputError:  # the camera has no such exposure
            return None
        if seen.state == GOOD:
            return seconds
    return None


def _refusal(
    seen: dict[str, Seen],
    wrong: list[str],
    right: dict[str, float | None],
    times: dict[str, float | None],
) -> str:
    told = ", ".join(f"{phase} is {seen[phase].state}" for phase in wrong)
    options = [
        f"--exposure-{'lit' if phase == LIT else 'leds'} {seconds:.3g}"
        for phase, seconds in right.items()
        if seconds is not None
    ]
    if options:
        step = f"photograph with {' '.join(options)}"
    elif STRAY in {seen[phase].state for phase in wrong}:
        step = "darken the room"
    elif all(seconds is None for seconds in times.values()):
        step = (
            "change the camera's exposure, or say one for each light with --exposure-leds and "
            "--exposure-lit"
        )
    else:
        step = "see to the lights, and to lens and camera"
    return f"the preflight: {told}: {step}; --no-preflight photographs all the same"
