"""One stop photographed under each light before a run: saturated, too dark, or good.

Highlights count as the calibration counts them: bright spots that lie above the dark photograph by
2 % of the largest number. A saturated photograph does not tell by how much, so where the camera
takes an exposure time, others are tried.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy.ndimage import label, maximum

from tbcad.errors import InputError
from tbcad.records.run import DARK, DARK_LIT, LIT
from tbcad.rig.control.photographs import Shot
from tbcad.rig.runs import Image16, decoded_image
from tbcad.types import Floats, Progress

THRESHOLD = 0.02  # of the largest number: less is no light, as of spots in a calibration
FULL = 0.99  # likewise: more is saturated, also in a JPEG file
MOST_SATURATED = {"leds": 0.1, LIT: 0.05}  # share of the highlights, and of the lit pixels
LEAST_PEAK = 0.15  # of the largest number: below, noise and rounding decide
LEAST_PIXELS = 2  # of a highlight
LEAST_LIT = 1e-3  # share of the pixels
MOST_STRAY = 0.25  # level that a hundredth of a dark photograph may exceed
TARGET = 0.6  # level of the brightest where the exposure is right: at other stops some are brighter
BRIGHTEST = {"leds": 0.9, LIT: 0.99}  # quantile that counts as the brightest
STEP, MOST_STEPS = 8.0, 6  # factor between exposures that are tried, and number of them
LONGEST_S = 30.0  # of them

Shoot = Callable[[str, float | None], Shot]
"""Takes the photograph of a phase with an exposure time; None: that which the camera has."""


class LightState(StrEnum):
    """Verdict on a photograph."""

    GOOD = "good"
    SATURATED = "saturated"
    TOO_DARK = "too dark"
    STRAY = "not dark"


@dataclass(frozen=True)
class Seen:
    """Levels of a photograph."""

    state: LightState
    peak: float  # level of its brightest light, of the largest number
    saturated: float  # share of the highlights, or of the lit pixels, that are
    highlights: int | None = None  # number of them; None where no single LED shines

    @property
    def factor(self) -> float:
        """Of the exposure that would be right; where nothing tells it, one that is worth a try."""
        if self.state == LightState.SATURATED:
            return 1 / STEP
        return TARGET / self.peak if self.peak > THRESHOLD else STEP

    @property
    def text(self) -> str:
        """In words."""
        what = "the light" if self.highlights is None else f"{self.highlights} highlights"
        seen = (
            f"peak {self.peak:.0%} of the largest number, {self.saturated:.0%} of {what} saturated"
        )
        if self.state in (LightState.GOOD, LightState.STRAY):
            return f"{self.state}: {seen}"
        how = "or less" if self.state == LightState.SATURATED else "or so"
        return f"{self.state}: {seen}: {self.factor:.2g} times the exposure {how} would be right"


def preflight(times: dict[str, float | None], shoot: Shoot, where: str, note: Progress) -> None:
    """Photograph one stop under each light, and say what is wrong.

    A time of None is that which the camera has; a note is given for each phase.

    InputError: an exposure will not do; it says which would.
    """
    dark: dict[str, Image16] = {}
    seen: dict[str, Seen] = {}
    for phase, seconds in times.items():
        image = _photographed(phase, seconds, shoot)
        if phase in (DARK, DARK_LIT):
            dark[phase] = image
        empty = dark.get(DARK)
        seen[phase] = look(phase, image, dark.get(DARK_LIT, empty) if phase == LIT else empty)
    seen = _leds_together(seen)
    for phase, one in seen.items():
        exposure = "" if times[phase] is None else f" at {times[phase]:g} s"
        note(f"preflight, {where}: {phase}{exposure} is {one.text}")
    wrong = {phase: one.state for phase, one in seen.items() if one.state != LightState.GOOD}
    if wrong:
        right = {phase: _right(phase, times[phase], seen[phase], shoot) for phase in _worst(seen)}
        told = ", ".join(f"{phase} is {state}" for phase, state in wrong.items())
        raise InputError(
            f"the preflight: {told}: {_step(wrong, right)}; --no-preflight photographs all the same"
        )


def look(phase: str, image: Image16, dark: Image16 | None) -> Seen:
    """Judge the photograph (h, w, 3) of a phase, less the dark one with its exposure, if given."""
    level = _level(image)
    if phase in (DARK, DARK_LIT):
        peak = float(np.quantile(level, 0.99))
        state = LightState.STRAY if peak > MOST_STRAY else LightState.GOOD
        return Seen(state, peak, float((level >= FULL).mean()))
    bright = (level if dark is None else level - _level(dark)) > THRESHOLD
    if phase == LIT:
        enough = bright.mean() >= LEAST_LIT
        return _judged(level[bright] if enough else np.zeros(0), LIT)
    spots, _ = label(bright, np.ones((3, 3)))
    large = 1 + np.flatnonzero(np.bincount(spots.ravel())[1:] >= LEAST_PIXELS)
    return _judged(np.asarray(maximum(level, spots, large), dtype=np.float64), "leds")


def _photographed(phase: str, seconds: float | None, shoot: Shoot) -> Image16:
    shot = shoot(phase, seconds)
    return decoded_image(shot.data, f"{phase}{shot.suffix}")


def _level(image: Image16) -> Floats:
    """Largest colour of each pixel, of the largest number, (h, w)."""
    return np.asarray(image.max(axis=2) / np.iinfo(image.dtype).max)


def _judged(levels: Floats, kind: str) -> Seen:
    number = None if kind == LIT else len(levels)
    if not len(levels):
        return Seen(LightState.TOO_DARK, 0.0, 0.0, number)
    peak, saturated = float(np.quantile(levels, BRIGHTEST[kind])), float((levels >= FULL).mean())
    state = LightState.GOOD if peak >= LEAST_PEAK else LightState.TOO_DARK
    state = LightState.SATURATED if saturated > MOST_SATURATED[kind] else state
    return Seen(state, peak, saturated, number)


def _leds_together(seen: dict[str, Seen]) -> dict[str, Seen]:
    """LEDs share one exposure: one that shows less is good where another shows enough."""
    dark = {phase for phase, one in seen.items() if one.state == LightState.TOO_DARK}
    some = {phase for phase, one in seen.items() if one.highlights}
    good = dark & some if some - dark else set()
    return seen | {phase: replace(seen[phase], state=LightState.GOOD) for phase in good}


def _worst(seen: dict[str, Seen]) -> list[str]:
    """The brightest LED, unless LEDs are as they should be, and the lit object likewise."""
    leds = {phase: one for phase, one in seen.items() if one.highlights is not None}
    saturated = [phase for phase, one in leds.items() if one.state == LightState.SATURATED]
    good = any(one.state == LightState.GOOD for one in leds.values())
    some = saturated or ([] if good else list(leds))
    some.sort(key=lambda phase: (-leds[phase].saturated, -leds[phase].peak))
    is_lit = LIT in seen and seen[LIT].state != LightState.GOOD
    return some[:1] + [LIT] * is_lit


def _right(phase: str, seconds: float | None, seen: Seen, shoot: Shoot) -> float | None:
    """Exposure time that is right for a phase, found by trying; None: not found."""
    if seconds is None:
        return None
    for _ in range(MOST_STEPS):
        seconds *= seen.factor
        if seconds > LONGEST_S:
            return None
        try:
            seen = look(phase, _photographed(phase, seconds, shoot), None)
        except InputError:  # the camera has no such exposure
            return None
        if seen.state == LightState.GOOD:
            return seconds
    return None


def _step(wrong: Mapping[str, LightState], right: Mapping[str, float | None]) -> str:
    options = [
        f"--exposure-{'lit' if phase == LIT else 'leds'} {seconds:.3g}"
        for phase, seconds in right.items()
        if seconds is not None
    ]
    steps = [f"photograph with {' '.join(options)}"] if options else []
    if None in right.values():
        steps.append(
            "change the camera's exposure, or say one for each light with --exposure-leds and "
            "--exposure-lit"
        )
    if LightState.STRAY in wrong.values():
        steps.append("darken the room")
    return ", and ".join(steps or ["see to the LED's wires, or leave it out with --phases"])
