"""One photograph: taken, read, compared with what the run is locked to, and recorded."""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from time import monotonic

from tbcad.errors import InputError
from tbcad.records.prototype_drive import Phase
from tbcad.records.run import Exposure, Frame, PhaseExposure, RunRecord, Setting, exposure_name
from tbcad.rig.control.camera import (
    ImageFacts,
    RunCamera,
    Shot,
    are_near,
    image_facts,
    shutter_seconds,
)
from tbcad.rig.control.plan import CameraFault, ControlPlan, DrivenMachine
from tbcad.rig.control.selection import RunSelection

SHUTTER = "shutterspeed"
UNNAMED = "unnamed camera"
OF_EXPOSURE = (SHUTTER, "shutterspeed2", "exposure_s")  # settings that an exposure time changes


@dataclass(frozen=True)
class Photograph:
    """A photograph that can be read."""

    shot: Shot
    facts: ImageFacts
    seconds: float
    # exposure time that the camera was told, s; None: it keeps its own
    asked_s: float | None = None

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
        """Exposure time, s, if it is known: as camera or file tell it, or else as asked for."""
        return self.told_s or self.asked_s

    @property
    def told_s(self) -> float | None:
        """Exposure time, s, that the camera or the file tells."""
        shutter = shutter_seconds(str(self.shot.settings.get(SHUTTER, "")))
        return shutter or self.facts.exposure_s


@contextmanager
def faults_refused(where: str = "the camera", step: str = "") -> Iterator[None]:
    """Before the first photograph a fault of the camera is one of the input."""
    try:
        yield
    except CameraFault as fault:
        raise InputError(f"{where}: {fault}{step}") from None


@contextmanager
def light_on(base: DrivenMachine, phase: Phase, seconds: float) -> Iterator[None]:
    """Have the light of a phase on, and let it settle for some seconds."""
    outputs = () if phase.output is None else (phase.output,)
    for output in outputs:
        base.light(output, on=True)
    base.wait(seconds)
    fault = None
    try:
        yield
    except CameraFault as error:  # of the machine nothing is wrong
        fault = error
    for output in outputs:
        base.light(output, on=False)
    if fault is not None:
        raise fault


def taken_twice(
    camera: RunCamera,
    base: DrivenMachine,
    seconds: float | None,
    check: Callable[[Photograph], None],
) -> Photograph:
    """A photograph that passes a check; a second one, over a new session, if the first fails."""
    try:
        photograph = take(camera, base, seconds)
        check(photograph)
    except CameraFault:
        camera.again()
        photograph = take(camera, base, seconds)
        check(photograph)
    return photograph


def take(camera: RunCamera, base: DrivenMachine, seconds: float | None = None) -> Photograph:
    """Take a photograph with an exposure time or the camera's own; CameraFault: there is none."""
    if seconds is not None:
        camera.expose(seconds)
    begun = monotonic()
    camera.expect()
    if camera.released:
        base.release()
    shot = camera.photograph()
    facts = image_facts(shot.data, shot.suffix)
    found = Photograph(shot, facts, monotonic() - begun, seconds)
    if seconds is not None and found.told_s is not None and not are_near(found.told_s, seconds):
        raise CameraFault(
            f"{seconds:g} s of exposure were asked for, and the photograph has {found.told_s:g} s: "
            "set the camera to manual exposure"
        )
    return found


def check_like_record(record: RunRecord, phase: str, photograph: Photograph) -> None:
    """Refuse a photograph that is not like the others of its run by a CameraFault."""
    if photograph.model != record.camera:
        raise CameraFault(f"the camera is {photograph.model}, and the run's is {record.camera}")
    size = photograph.facts.width_px, photograph.facts.height_px
    if size != (record.width_px, record.height_px):
        raise CameraFault(
            f"the photograph has {size[0]} x {size[1]} pixels, and the run's have "
            f"{record.width_px} x {record.height_px}"
        )
    settings = photograph.settings
    for name, value in record.locked_in(phase).items():
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


def run_record(
    plan: ControlPlan, options: RunSelection, trials: Mapping[str, Photograph], seconds: float
) -> RunRecord:
    """The record of a run, by a photograph for each phase and its expected duration."""
    with faults_refused():
        locked = common_settings(trials.values())
    trial = next(iter(trials.values()))
    return RunRecord(
        export_sha256=plan.sha256,
        source="camera",
        camera=trial.model,
        width_px=trial.facts.width_px,
        height_px=trial.facts.height_px,
        phases=tuple(trials),
        frames=options.frames,
        locked=locked,
        exposures={
            name: PhaseExposure(
                asked_s=one.asked_s,
                settings={key: value for key, value in one.settings.items() if key not in locked},
            )
            for name, one in trials.items()
            if one.asked_s is not None
        },
        seconds=round(seconds, 1),
    )


def common_settings(photographs: Iterable[Photograph]) -> dict[str, Setting]:
    """Settings that are the same at all exposure times; CameraFault: others differ."""
    first, *others = [photograph.settings for photograph in photographs]
    for other in others:
        for name in sorted((first.keys() | other.keys()) - {*OF_EXPOSURE}):
            if first.get(name) != other.get(name):
                raise CameraFault(
                    f"{name} is {first.get(name)} at one exposure time and {other.get(name)} at "
                    "another: set it to one value"
                )
    same = [name for name in first if all(first[name] == other.get(name) for other in others)]
    return {name: first[name] for name in same}
