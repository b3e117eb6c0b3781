"""run.json: what a run is to photograph, of which export and with which camera."""

from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from tbcad.records.document import Document, RecordSection
from tbcad.records.exposure import DARK_LIT, LIT, Frame, PhaseName, PhaseTimes, Setting

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
        export_sha256: of each file of the export that the run depends on, by name.
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
    """The record of a run's folder.

    Raises:
        InputError: there is none, or it does not fit.
    """
    return RunRecord.read(folder / RECORD)
