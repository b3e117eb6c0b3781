"""Calls about the machine as it is built: driven, photographed, calibrated, merged, drawn."""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from tbcad.common.screen import Stages
from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.captures import Optics
from tbcad.options.shared import (
    AnyPath,
    CalibrationFolder,
    Exports,
    ExportsOption,
    ExposureLeds,
    ExposureLit,
    Force,
    ForceFile,
    ObjectFile,
    OutReplaced,
    PlotFormatOption,
    RunFolder,
    UnitOption,
    UpOption,
    exposures,
    numbers,
)

MOST_NOISE = 100.0
MOST_BRIGHTNESS = 10_000.0


@dataclass(frozen=True)
class CalibrateOptions(Call):
    """The photographs of a run, how the machine was made, and what of it was measured."""

    run: RunFolder[AnyPath]
    exports: Annotated[AnyPath, typer.Option(metavar="FOLDER")] = Path("exports")
    """Folder written by tbcad build."""
    _: KW_ONLY
    out: OutReplaced[AnyPath] = Path("calibration")
    process: Annotated[str | None, typer.Option(metavar="NAME|FILE")] = None
    """How the prototype is made: fdm, sls, sla, cnc, diamond, or a TOML file. By default fdm."""
    settings: Annotated[Sequence[str], typer.Option("--set", metavar="KIND=VALUE")] = ()
    """Change any error of the process; repeatable."""
    measured: Annotated[Sequence[str], typer.Option(metavar="BALL=MM")] = ()
    """Measured radius of a ball or cap, 1=43.21, with its standard deviation in mm 1=43.21:0.005,
    by default 0.01 mm; repeatable."""
    intrinsics: Annotated[AnyPath | None, typer.Option(metavar="FILE")] = None
    """Lens of the camera as OpenCV (YAML, XML), ROS, Kalibr (YAML), mrcal (.cameramodel), COLMAP
    (cameras.txt) or tbcad intrinsics wrote it. By default the lens is estimated too."""
    plot: PlotFormatOption = "svg"
    force: Force = False


@dataclass(frozen=True)
class IntrinsicsOptions(Call):
    """Photographs of a board, and its measures."""

    folder: Annotated[AnyPath, typer.Argument(metavar="FOLDER")]
    """Photographs of a board, one camera."""
    _: KW_ONLY
    squares: Annotated[str, typer.Option(metavar="WxH")] = "9x6"
    """Squares of the board, columns x rows."""
    size: Annotated[float, typer.Option(min=0.1, max=1000)] = 5.0
    """Width of a square, mm."""
    charuco: Annotated[str | None, typer.Option(metavar="DICTIONARY")] = None
    """Markers of a ChArUco board, for instance 4x4_50."""
    marker: Annotated[float | None, typer.Option(metavar="MM")] = None
    """Width of a ChArUco board's markers, mm."""
    out: Annotated[AnyPath, typer.Option("--out", "-o")] = Path("camera.yml")
    """File to write, YAML as OpenCV writes it."""
    force: ForceFile = False


@dataclass(frozen=True)
class MergeOptions(Call):
    """A run, its calibration, and how photographs are corrected."""

    run: RunFolder[AnyPath]
    calibration: CalibrationFolder[AnyPath] = Path("calibration")
    exports: ExportsOption[AnyPath] = None
    _: KW_ONLY
    out: Annotated[AnyPath | None, typer.Option("--out", "-o")] = None
    """Folder for all files; replaced atomically. By default captures/ with the name
    of the run, such as captures/first."""
    vignetting: Literal["off", "cos4"] = "cos4"
    """cos4: correct the natural vignetting of the lens; off: the photographs are even already."""
    flat: Annotated[Sequence[AnyPath], typer.Option(metavar="FILE")] = ()
    """Photograph of an even surface, in place of --vignetting; repeatable, the mean counts."""
    encoding: Literal["linear", "srgb"] = "linear"
    """linear: numbers of the photographs are proportional to light, as of raw pictures; srgb: as in
    a camera's JPEGs."""
    brightness: Annotated[float, typer.Option(min=1e-3, max=1e3)] = 1.0
    """Factor of the light of all pixels."""
    force: Force = False

    @property
    def folder(self) -> Path:
        """Of the files."""
        return Path(self.out or Path("captures") / Path(self.run).resolve().name)


@dataclass(frozen=True)
class AsBuiltOptions(Call):
    """A calibrated prototype."""

    calibration: Annotated[AnyPath, typer.Argument(metavar="FOLDER")]
    """Folder written by tbcad calibrate."""
    exports: ExportsOption[AnyPath] = None
    _: KW_ONLY
    out: OutReplaced[AnyPath] = Path("asbuilt")
    force: Force = False


@dataclass(frozen=True)
class SimulateRunOptions(Call):
    """A build, how it is built and lit, and what is photographed of it."""

    exports: Exports[AnyPath]
    _: KW_ONLY
    process: str = "fdm"
    """fdm, sls, sla, cnc, diamond, or a TOML file: how the prototype is built."""
    seed: Annotated[int, typer.Option(min=0)] = 0
    """Of the build and of all noise."""
    out: Annotated[AnyPath, typer.Option("--out", "-o")] = Path("run")
    """Folder for the run; it must not hold anything."""
    object_file: ObjectFile[AnyPath] = None
    up: UpOption = None
    unit: UnitOption = None
    stops: Annotated[str | None, typer.Option(metavar="LIST")] = None
    """Only these stops, as 1,5,20-30; by default all."""
    phases: Annotated[str | None, typer.Option(metavar="LIST")] = None
    """Only these phases, as dark,led_1,led_2; by default all."""
    noise: Annotated[float, typer.Option(min=0, max=MOST_NOISE)] = 1.0
    """Factor of all noise; 0 for none."""
    bits: int = 8
    """Of each pixel's number: 8 in colour, or 16 without."""
    shell: bool = False
    """Both cameras of the shell, one photograph each, not the prototype."""
    led_brightness: Annotated[
        float, typer.Option(metavar="FACTOR", min=0.001, max=MOST_BRIGHTNESS)
    ] = 1.0
    """Brightness of the LEDs. 1: at 1 s they fill 0.9 of a pixel, as the lit object's white does;
    of a real LED some 100."""
    exposure_leds: ExposureLeds[str | float] = None
    exposure_lit: ExposureLit[str | float] = None
    perfect: bool = False
    """A build without errors that gravity does not turn, before a lens without distortion."""
    optics: Optics = "ideal"
    """ideal: a pinhole, spread by an even blur, and no cast shadow. real: object and highlights
    through lens and pupil of camera.json, shadows of the lamps, what balls scatter, as in tbcad
    capture --optics real; dust, hot pixels, noise and errors of the build in both."""
    gloss: Annotated[float | None, typer.Option(min=0.05, max=1, metavar="ROUGHNESS")] = None
    """With --optics real: the object's roughness, from 0.05 (polished) to 1, in place of that of
    its materials; by default as these say, else matt."""

    def check(self) -> None:
        """Refuse options that exclude each other, and numbers that are none.

        InputError: which, and what is allowed.
        """
        if self.bits not in (8, 16):
            raise InputError(f"--bits {self.bits} is not written: allowed is 8 or 16")
        if self.gloss is not None and self.optics == "ideal":
            raise InputError("--gloss is of --optics real: add that, or leave it out")
        if self.gloss is not None and "lit" not in (self.phase_names() or ("lit",)):
            raise InputError("--gloss is seen in phase lit alone: add lit, or leave out --gloss")
        self.stop_numbers()
        exposures(self.exposure_leds, self.exposure_lit)

    def stop_numbers(self) -> tuple[int, ...] | None:
        """The stops; None for all; InputError: they are no list of numbers."""
        return None if self.stops is None else numbers(self.stops)

    def phase_names(self) -> tuple[str, ...] | None:
        """The phases; None for all."""
        if self.phases is None:
            return None
        return tuple(part.strip() for part in self.phases.split(","))


_SIZE = re.compile(r"(\d{2,5})x(\d{2,5})$")
LEAST_PX = 16
Preflight = Literal["first", "only", "off"]
Ask = Callable[[str], bool]  # asks the operator to do something; False: the operator will not
Show = Callable[[Mapping[str, float]], AbstractContextManager[Stages]]
"""Shows stages with their expected seconds while a block runs."""


@dataclass(frozen=True)
class RunOptions(Call):
    """What is photographed of a prototype, by which controller and camera."""

    exports: Exports[AnyPath]
    out: Annotated[AnyPath, typer.Option("--out", "-o")] = Path("runs/first")
    """Folder of the run, which must be new."""
    _: KW_ONLY
    port: Annotated[str | None, typer.Option(metavar="PORT")] = None
    """Serial port of the controller, such as /dev/ttyUSB0; Klipper: moonraker:http://HOST:7125."""
    camera: Annotated[str, typer.Option(metavar="CAMERA")] = "gphoto2"
    """gphoto2: the camera on USB; command:PROGRAM ARGUMENTS, with {output} for the image's path
    without suffix and {exposure_s}, {exposure_ms} or {exposure_us} for the exposure; folder:PATH,
    where another program puts photographs."""
    resume: bool = False
    """Go on with the run in the folder of --out."""
    phases: Annotated[str | None, typer.Option(metavar="NAMES")] = None
    """Photographs at each stop: dark, led_1, led_2 ..., lit, with commas between; leds for all
    LEDs. By default all."""
    stops: Annotated[str | None, typer.Option(metavar="LIST")] = None
    """Stops to photograph, such as 1-10,40. By default all."""
    runs: Annotated[str | None, typer.Option(metavar="a|b|ab")] = None
    """a: object straight; b: turned by 180 degrees; ab: both, the default."""
    size_px: Annotated[tuple[int, int] | str | None, typer.Option("--size", metavar="WxH")] = None
    """Pixels of a photograph, such as 4160x3104. By default those of the design."""
    timeout_s: Annotated[
        float, typer.Option("--time-limit", "--timeout", metavar="S", min=1, max=3600)
    ] = 30.0
    """Seconds that command: and folder: may take for one photograph."""
    exposure_leds_s: ExposureLeds[str | float] = None
    exposure_lit_s: ExposureLit[str | float] = None
    send_settings: bool = False
    """Send the controller the settings of grbl_settings.txt that differ."""
    preflight: Annotated[
        Preflight,
        "first: one stop is looked at under each light before a new run; only: and nothing is "
        "photographed; off: it is not.",
    ] = "first"
    ask: Annotated[
        Ask | None,
        "Called with what a person must do, such as turn the object; says whether it is done.",
    ] = None
    show: Annotated[
        Show | None, "Shows stages with their expected seconds, as tbcad.common.screen.stages does."
    ] = None

    def size(self) -> tuple[int, int] | None:
        """Columns and rows of a photograph; InputError: they are none."""
        if self.size_px is None or isinstance(self.size_px, tuple):
            return self.size_px
        match = _SIZE.match(self.size_px)
        width, height = (int(match[1]), int(match[2])) if match else (0, 0)
        if min(width, height) < LEAST_PX:
            raise InputError(
                f"--size is {self.size_px!r:.40}, allowed is WIDTHxHEIGHT of {LEAST_PX} pixels or "
                "more, such as 4160x3104"
            )
        return width, height
