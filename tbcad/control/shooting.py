"""One photograph: taken, read, compared with what the run is locked to, and recorded."""

import hashlib
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from time import monotonic

from tbcad.control.cameras.camera import Camera, Shot
from tbcad.control.cameras.image_facts import ImageFacts, image_facts
from tbcad.control.faults import CameraFault
from tbcad.control.machine import Machine
from tbcad.runs.exposure import Exposure, Frame, Setting, exposure_name
from tbcad.runs.record import RunRecord

SHUTTER = "shutterspeed"
UNNAMED = "unnamed camera"
_TIME = re.compile(r"(\d+(?:\.\d+)?)(?:/(\d+(?:\.\d+)?))?\s*s?$")


@dataclass(frozen=True)
class Photograph:
    """A photograph that can be read.

    Attributes:
        shot: as the camera gave it.
        facts: what its file says.
        seconds: that it took.
    """

    shot: Shot
    facts: ImageFacts
    seconds: float

    @property
    def settings(self) -> dict[str, Setting]:
        """What must not change in a run, as far as it is known."""
        return self.facts.settings | self.shot.settings

    @property
    def model(self) -> str:
        """The camera's name."""
        return str(self.shot.settings.get("model") or self.facts.model or UNNAMED)

    @property
    def exposure_s(self) -> float | None:
        """Exposure time, s, if it is known."""
        match = _TIME.match(str(self.shot.settings.get(SHUTTER, "")))
        if match is None or float(match[2] or 1) == 0 or float(match[1]) == 0:
            return self.facts.exposure_s
        return float(match[1]) / float(match[2] or 1)


def take(camera: Camera, base: Machine) -> Photograph:
    """Take one photograph.

    Raises:
        CameraFault: there is none, or it cannot be read.
        MachineFault: the controller does not release the camera.
    """
    begun = monotonic()
    camera.expect()
    if camera.released:
        base.release()
    shot = camera.photograph()
    return Photograph(shot, image_facts(shot.data, shot.suffix), monotonic() - begun)


def check_like_record(record: RunRecord, photograph: Photograph) -> None:
    """Refuse a photograph that is not like the others of its run.

    Raises:
        CameraFault: it has another size or setting, or is of another camera.
    """
    if photograph.model != record.camera:
        raise CameraFault(f"the camera is {photograph.model}, and the run's is {record.camera}")
    size = photograph.facts.width_px, photograph.facts.height_px
    if size != (record.width_px, record.height_px):
        raise CameraFault(
            f"the photograph has {size[0]} x {size[1]} pixels, and the run's have "
            f"{record.width_px} x {record.height_px}"
        )
    settings = photograph.settings
    for name, value in record.locked.items():
        if settings.get(name) != value:
            raise CameraFault(
                f"{name} is {settings.get(name, 'not told')}, and the run is locked to {value}"
            )


def exposure_of(photograph: Photograph, frame: Frame, phase: str) -> Exposure:
    """The sidecar of a photograph."""
    return Exposure(
        frame=frame,
        phase=phase,
        file=exposure_name(frame, phase) + photograph.shot.suffix,
        sha256=hashlib.sha256(photograph.shot.data).hexdigest(),
        width_px=photograph.facts.width_px,
        height_px=photograph.facts.height_px,
        exposure_s=photograph.exposure_s,
        taken=datetime.now(UTC),
        settings=photograph.settings,
    )
