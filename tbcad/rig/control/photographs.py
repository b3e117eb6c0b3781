"""Photographs: what a run asks of a camera, what a file says, and what the run is locked to.

Source: Exif 2.32, tables 4 and 7.
"""

import io
import math
import re
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, Protocol

from PIL import Image

from tbcad.cad.formats.pictures import PICTURE_SUFFIXES, RAW_SUFFIXES
from tbcad.cad.formats.pixels import TIFF_SIGNATURES
from tbcad.errors import InputError
from tbcad.records.prototype_drive import Phase
from tbcad.records.run import PhaseExposure, RunRecord, Setting
from tbcad.rig.control.klipper_base import DrivenMachine
from tbcad.rig.control.plan import CameraFault, ControlPlan
from tbcad.rig.control.selection import RunSelection
from tbcad.rig.runs import decoded_image

NEAR = 1.5  # factor of exposure times: the coarsest cameras have steps of 2
_TIME = re.compile(r"(\d+(?:\.\d+)?)(?:/(\d+(?:\.\d+)?))?\s*s?$")
FORMATS = {"PNG": ".png", "TIFF": ".tif", "JPEG": ".jpg", "MPO": ".jpg"}
SAME_FORMAT = {".tiff": ".tif", ".jpeg": ".jpg"}
MAKE, MODEL, EXIF = 0x010F, 0x0110, 0x8769
EXPOSURE = 0x829A
DECIMALS = 9  # of numbers that Exif has as fractions
# What must not change in a run, by the names that gphoto2 has for it where it has one.
LOCKED = {
    EXPOSURE: "exposure_s",
    0x829D: "f_number",
    0x8827: "iso",
    0xA403: "white_balance",
    0x920A: "focal_length_mm",
}


@dataclass(frozen=True)
class Shot:
    """A photograph as the camera gives it."""

    data: bytes  # bytes of the image file, unchanged
    suffix: str  # of its name, in small letters, with the dot
    settings: dict[str, Setting]  # that the camera itself reports for it; the file may tell more


class RunCamera(Protocol):
    """A camera that is connected; what most need not do is done by default."""

    released: bool  # whether the controller's relay releases it

    def expose(self, seconds: float) -> None:
        """Set the exposure time of the photographs that follow."""

    def expect(self) -> None:
        """Get ready for a photograph: what was there before is none."""
        return

    def photograph(self) -> Shot:
        """Take a photograph, or wait for the one that was released."""

    def again(self) -> None:
        """Connect anew, after a fault."""
        return

    def close(self) -> None:
        """Give the camera up."""
        return


def shutter_seconds(text: str) -> float | None:
    """Exposure time of a camera's shutter setting, as 1/60 or 0.0100s; None: it says none."""
    match = _TIME.match(text)
    if match is None or float(match[2] or 1) == 0 or float(match[1]) == 0:
        return None
    return float(match[1]) / float(match[2] or 1)


def are_near(one: float, other: float) -> bool:
    """Whether two exposure times are the same but for a camera's steps."""
    return abs(math.log(one / other)) <= math.log(NEAR)


@dataclass(frozen=True)
class ImageFacts:
    """Contents of a photograph's file."""

    size_px: tuple[int, int]  # columns and rows
    model: str  # of the camera; empty if the file does not say
    exposure_s: float | None  # exposure time; None if the file does not say
    settings: dict[str, Setting]  # that must not change in a run, as far as the file says them


def image_facts(data: bytes, suffix: str) -> ImageFacts:
    """Read all of an image file; CameraFault: of no kind that a run takes, or not complete."""
    if suffix not in PICTURE_SUFFIXES:
        raise CameraFault(
            f"the camera gives {suffix or 'nameless'} files: set its image format to JPEG, TIFF, "
            "PNG or raw"
        )
    try:
        height, width = decoded_image(data, f"photograph{suffix}").shape[:2]
    except InputError as error:
        raise CameraFault(str(error)) from None
    kind, tags, inner = _kind_and_tags(data)
    if suffix not in RAW_SUFFIXES and FORMATS.get(kind) != SAME_FORMAT.get(suffix, suffix):
        raise CameraFault(f"the photograph is a {kind} file and is called {suffix}")
    told = {name: _setting(inner.get(tag)) for tag, name in LOCKED.items()}
    exposure = told[LOCKED[EXPOSURE]]
    return ImageFacts(
        size_px=(width, height),
        model=" ".join(str(tags[tag]).strip("\0 ") for tag in (MAKE, MODEL) if tag in tags),
        exposure_s=float(exposure) if exposure and not isinstance(exposure, str) else None,
        settings={name: value for name, value in told.items() if value is not None},
    )


def _kind_and_tags(data: bytes) -> tuple[str, Mapping[int, Any], Mapping[int, Any]]:
    """Format of an image, its tags and those of Exif: none where they cannot be read."""
    kind, tags = "TIFF" if data.startswith(TIFF_SIGNATURES) else "", Image.Exif()
    try:
        if kind:  # raw files too, and kinds that Pillow does not open
            tags.load(data)
        else:
            with Image.open(io.BytesIO(data)) as image:
                kind, tags = image.format or "", image.getexif()
        return kind, tags, tags.get_ifd(EXIF)
    except (OSError, ValueError, SyntaxError, struct.error):
        return kind, {}, {}


def suffix_of(name: str) -> str:
    """Suffix of a file's name in small letters."""
    return Path(name).suffix.lower()


def _setting(value: Any) -> Setting | None:
    """A tag's value as JSON has it; None: not told."""
    if isinstance(value, tuple):
        value = value[0] if value else None
    if value is None or isinstance(value, str | int):
        return value
    try:
        number = round(float(value), DECIMALS)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) else None


SHUTTER = "shutterspeed"
UNNAMED = "unnamed camera"
OF_EXPOSURE = (SHUTTER, "shutterspeed2", "exposure_s")  # settings that an exposure time changes


@dataclass(frozen=True)
class Photograph:
    """A photograph that can be read."""

    shot: Shot
    size_px: tuple[int, int]  # columns and rows
    model: str  # of the camera
    settings: dict[str, Setting]  # that must not change in a run, as far as they are known
    seconds: float  # that it took
    asked_s: float | None = None  # exposure time that the camera was told; None: it keeps its own
    told_s: float | None = None  # exposure time that the camera or the file tells


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
    facts, told = image_facts(shot.data, shot.suffix), shot.settings
    told_s = shutter_seconds(str(told.get(SHUTTER, ""))) or facts.exposure_s
    if seconds is not None and told_s is not None and not are_near(told_s, seconds):
        raise CameraFault(
            f"{seconds:g} s of exposure were asked for, and the photograph has {told_s:g} s: "
            "set the camera to manual exposure"
        )
    model = str(told.get("model") or facts.model or UNNAMED)
    took, settings = monotonic() - begun, facts.settings | told
    return Photograph(shot, facts.size_px, model, settings, took, seconds, told_s)


def check_like_record(record: RunRecord, phase: str, photograph: Photograph) -> None:
    """Refuse a photograph that is not like the others of its run by a CameraFault."""
    if photograph.model != record.camera:
        raise CameraFault(f"the camera is {photograph.model}, and the run's is {record.camera}")
    width, height = photograph.size_px
    if (width, height) != (record.width_px, record.height_px):
        raise CameraFault(
            f"the photograph has {width} x {height} pixels, and the run's have {record.width_px} x "
            f"{record.height_px}"
        )
    settings = photograph.settings
    for name, value in record.locked_in(phase).items():
        if settings.get(name) != value:
            raise CameraFault(
                f"{name} is {settings.get(name, 'not told')}, and the run is locked to {value}"
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
        width_px=trial.size_px[0],
        height_px=trial.size_px[1],
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
