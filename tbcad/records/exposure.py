"""One exposure of a run: which stop and light, by which settings; its file and its sidecar.

A run's folder holds

    run.json                 what is to be photographed, of which export, by which camera
    journal.jsonl            what has been done: a line for each event, each safe on disk
    photographs/NAME.png     one image for each exposure (or .tif, .jpg as the camera gives)
    photographs/NAME.json    its sidecar

with names as `a_0012_led_1`: run a (object straight) or b (object turned by 180 degrees), stop,
phase. Photographs are never changed after they are written.
"""

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from tbcad.cad.formats.checked_files import Finite
from tbcad.errors import InputError
from tbcad.records.document import Document, RecordSection

PHOTOGRAPHS = "photographs"
DARK, LIT, DARK_LIT = "dark", "lit", "dark_lit"
"""Phases beside those of the LEDs, which have the names of prototype.json: led_1, led_2 ...

`dark` has the exposure of the LEDs, `dark_lit` that of the lit object: it is photographed where
both differ.
"""
SAME_TIME = 0.02  # relative: what is set as 1/60 is reported as 0.0167
MOST_SCALED = 2.0  # factor of a dark photograph: more enlarges its noise beyond what it is worth

PhaseName = Annotated[str, Field(pattern=r"^(dark|dark_lit|lit|led_[1-9]\d?)$")]
Setting = str | int | float | bool


@dataclass(frozen=True)
class PhaseTimes:
    """Exposure times that are asked for; one alone is for all phases.

    Raises an `InputError` where one is not above zero.

    Attributes:
        leds_s: of LEDs and darkness, s; None: not said.
        lit_s: of the lit object, s; likewise.
    """

    leds_s: float | None = None
    lit_s: float | None = None

    def __post_init__(self) -> None:
        """Check the times."""
        for seconds in (self.leds_s, self.lit_s):
            if seconds is not None and not 0 < seconds < math.inf:
                raise InputError(
                    f"an exposure is {seconds!r}, allowed are seconds above 0: change it"
                )

    def of(self, phase: str) -> float | None:
        """Exposure time of a phase, s; None: that which the camera has."""
        leds, lit = self.leds_s, self.lit_s
        first, second = (lit, leds) if phase in (LIT, DARK_LIT) else (leds, lit)
        return second if first is None else first

    def phases(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Phases, with a dark one for the lit object before it where `dark` has another time."""
        if not {DARK, LIT} <= set(names) or self.of(DARK) == self.of(LIT) or DARK_LIT in names:
            return names
        at = names.index(LIT)
        return (*names[:at], DARK_LIT, *names[at:])


def dark_factor(dark_s: float | None, exposure_s: float | None) -> float | None:
    """Factor that brings a dark photograph to another exposure time.

    Dark signal and stray light grow with the time; so do noise and rounding when they are scaled.

    Args:
        dark_s: exposure time of the dark photograph, s; None where it is not known.
        exposure_s: of the one that it is subtracted from, likewise.

    Returns:
        One where the times are the same or not known; None where the dark photograph is too short
        to be subtracted.
    """
    if dark_s is None or exposure_s is None or abs(exposure_s / dark_s - 1) <= SAME_TIME:
        return 1.0
    ratio = exposure_s / dark_s
    return ratio if ratio <= MOST_SCALED else None


class Frame(RecordSection):
    """A position in which the machine is photographed.

    Attributes:
        object_turn_deg: 0 in run a, 180 in run b.
        stop: number of the stop, from 1, as in rotation_plan.csv.
        base_angle_deg: of the base there, as planned.
    """

    object_turn_deg: Literal[0, 180]
    stop: int = Field(ge=1, le=1_000_000)
    base_angle_deg: Annotated[float, Field(ge=-360, le=360)]


class Exposure(Document):
    """The sidecar of a photograph.

    Attributes:
        frame: where the machine was.
        phase: which light was on.
        file: name of the image, in the same folder.
        sha256: of the image's bytes.
        width_px: columns.
        height_px: rows.
        exposure_s: exposure time; None where the camera does not tell.
        taken: when, as UTC.
        settings: of the camera, as it reports them.
    """

    MISSING: ClassVar[str] = "photograph it again with tbcad run --resume"
    schema_name: Literal["tbcad-exposure/1"] = Field("tbcad-exposure/1", alias="schema")
    frame: Frame
    phase: PhaseName
    file: str = Field(pattern=r"^[ab]_\d{4,7}_[a-z]+(_[a-z\d]+)?\.[a-z0-9]+$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    width_px: int = Field(ge=16, le=65_536)
    height_px: int = Field(ge=16, le=65_536)
    exposure_s: Annotated[Finite, Field(gt=0)] | None
    taken: datetime
    settings: dict[str, Setting]


def exposure_name(frame: Frame, phase: str) -> str:
    """Name of a photograph without its suffix."""
    return f"{'b' if frame.object_turn_deg else 'a'}_{frame.stop:04d}_{phase}"
