"""A run: run.json, what is to be photographed; exposures, which are the photographs' sidecars.

A run's folder holds

    run.json                 what is to be photographed, of which build, by which camera
    journal.jsonl            what has been done: a line for each event, each safe on disk
    photographs/NAME.png     one image for each exposure (or .tif, .jpg as the camera gives)
    photographs/NAME.json    its sidecar

with names as `a_0012_led_1`: run a (object straight) or b (object turned by 180 degrees), stop,
phase. Photographs are never changed after they are written.
"""

import math
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from tbcad.cad.formats.checked_files import Finite
from tbcad.errors import InputError
from tbcad.records.camera_sheet import RealOpticsRecord
from tbcad.records.document import Document, RecordSection

PHOTOGRAPHS = "photographs"
DARK, LIT, DARK_LIT = "dark", "lit", "dark_lit"
"""Phases beside those of the LEDs, which have the names of prototype.json: led_1, led_2 ...

`dark` has the exposure of the LEDs, `dark_lit` that of the lit object: it is photographed where
both differ.
"""
SAME_TIME = 0.02  # relative: what is set as 1/60 is reported as 0.0167

PhaseName = Annotated[str, Field(pattern=r"^(dark|dark_lit|lit|led_[1-9]\d?)$")]
Setting = str | int | float | bool


@dataclass(frozen=True)
class PhaseTimes:
    """Exposure times that are asked for; one alone is for all phases.

    Raises an `InputError` where one is not above zero.
    """

    leds_s: float | None = None  # of LEDs and darkness, s; None: not said
    lit_s: float | None = None  # of the lit object, s; likewise

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


def same_exposure(one_s: float | None, other_s: float | None) -> bool:
    """Whether two exposure times, s, are the same as far as they are known.

    A dark photograph is subtracted from one of its own exposure only.
    """
    return one_s is None or other_s is None or abs(other_s / one_s - 1) <= SAME_TIME


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


Geometry = Literal["prototype", "shell"]
RECORD, JOURNAL = "run.json", "journal.jsonl"


class PhaseExposure(RecordSection):
    """Exposure of a phase that has its own.

    Attributes:
        asked_s: exposure time that was asked for, s.
        settings: of the camera at it, which may not change, by name.
    """

    asked_s: float = Field(gt=0)
    settings: dict[str, Setting]


class RunRecord(Document):
    """What a run is to photograph: every frame in every phase.

    Attributes:
        export_sha256: of each file of the build that the run depends on, by name.
        source: "camera", or "simulated" by tbcad simulate-run.
        camera: model of the camera.
        width_px: columns of every photograph.
        height_px: rows.
        phases: at each stop, in the order of photographing.
        frames: in the order of photographing: all stops of run a, then of run b.
        locked: settings of the camera that may not change, by name.
        exposures: of each phase, where the camera was told them; else the camera's own is locked.
        seconds: expected duration of the whole run.
        geometry: "prototype": one camera before balls on a base took all; "shell": frames with the
            object turned are camera b's, which has the object before it that way.
        real: lens and mirrors of a simulated run with --optics real; not there of any other.
    """

    MISSING: ClassVar[str] = "name a folder that tbcad run or simulate-run wrote"
    schema_name: Literal["tbcad-run/1"] = Field("tbcad-run/1", alias="schema")
    export_sha256: dict[str, str]
    source: Literal["camera", "simulated"]
    camera: str
    width_px: int = Field(ge=16, le=65_536)
    height_px: int = Field(ge=16, le=65_536)
    phases: tuple[PhaseName, ...] = Field(min_length=1)
    frames: tuple[Frame, ...] = Field(min_length=1)
    locked: dict[str, Setting]
    exposures: dict[PhaseName, PhaseExposure] = Field(default_factory=dict)
    seconds: float = Field(ge=0)
    geometry: Geometry = "prototype"
    real: RealOpticsRecord | None = None

    def document(self) -> dict[str, Any]:
        """The JSON object."""
        found = super().document()
        return found if self.real else {key: found[key] for key in found if key != "real"}

    @model_validator(mode="after")
    def _nothing_twice(self) -> "RunRecord":
        keys = [(frame.object_turn_deg, frame.stop) for frame in self.frames]
        if len(set(keys)) < len(keys) or len(set(self.phases)) < len(self.phases):
            raise ValueError("names a frame or phase twice")
        return self

    def locked_in(self, phase: str) -> dict[str, Setting]:
        """Settings that may not change among the photographs of a phase."""
        own = self.exposures.get(phase)
        return self.locked if own is None else self.locked | own.settings

    @property
    def times(self) -> PhaseTimes:
        """Exposure times that the camera was told."""
        of_lit = LIT, DARK_LIT
        asked = [(name in of_lit, one.asked_s) for name, one in self.exposures.items()]
        leds, lit = (dict(reversed(asked)).get(is_lit) for is_lit in (False, True))
        return PhaseTimes(leds, lit)

    @property
    def machines(self) -> dict[str, tuple[Frame, ...]]:
        """Frames of each machine by its name: a prototype has none, a shell's cameras a and b."""
        if self.geometry == "prototype":
            return {"": self.frames}
        found: dict[str, tuple[Frame, ...]] = {}
        for frame in self.frames:
            name = "b" if frame.object_turn_deg else "a"
            found[name] = (*found.get(name, ()), frame)
        return found


def read_record(folder: Path) -> RunRecord:
    """The record of a run's folder. InputError: there is none, or it does not fit."""
    return RunRecord.read(folder / RECORD)
