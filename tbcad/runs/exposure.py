"""One exposure of a run: which stop and light, by which settings; its file and its sidecar.

A run's folder holds

    run.json                 what is to be photographed, of which export, by which camera
    journal.jsonl            what has been done: a line for each event, each safe on disk
    photographs/NAME.png     one image for each exposure (or .tif, .jpg as the camera gives)
    photographs/NAME.json    its sidecar

with names as `a_0012_led_1`: run a (object straight) or b (object turned by 180 degrees), stop,
phase. Photographs are never changed after they are written.
"""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from tbcad.formats.checked_files import Finite, Record

EXPOSURE_SCHEMA = "tbcad-exposure/1"
PHOTOGRAPHS = "photographs"
DARK, LIT = "dark", "lit"
"""Phases beside those of the LEDs, which have the names of prototype.json: led_1, led_2 ..."""

PhaseName = Annotated[str, Field(pattern=r"^(dark|lit|led_[1-9]\d?)$")]
Setting = str | int | float | bool


class Frame(Record):
    """A position in which the machine is photographed.

    Attributes:
        object_turn_deg: 0 in run a, 180 in run b.
        stop: number of the stop, from 1, as in rotation_plan.csv.
        base_angle_deg: of the base there, as planned.
    """

    object_turn_deg: Literal[0, 180]
    stop: int = Field(ge=1, le=1_000_000)
    base_angle_deg: Annotated[float, Field(ge=-360, le=360)]


class Exposure(Record):
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

    frame: Frame
    phase: PhaseName
    file: str = Field(pattern=r"^[ab]_\d{4,7}_[a-z]+(_\d+)?\.[a-z0-9]+$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    width_px: int = Field(ge=16, le=65_536)
    height_px: int = Field(ge=16, le=65_536)
    exposure_s: Annotated[Finite, Field(gt=0)] | None
    taken: datetime
    settings: dict[str, Setting]


def exposure_name(frame: Frame, phase: str) -> str:
    """Name of a photograph without its suffix."""
    return f"{'b' if frame.object_turn_deg else 'a'}_{frame.stop:04d}_{phase}"
