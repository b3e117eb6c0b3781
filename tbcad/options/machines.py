"""Calls about the machine as it is built: photographed, calibrated, merged, drawn."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from tbcad.options.call import Call
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
    plot: PlotFormatOption = "png"
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
    """Folder for all files; replaced as a whole or not at all. By default captures/ with the name
    of the run, such as captures/first."""
    vignetting: Literal["off", "cos4"] = "cos4"
    """cos4: make good the natural loss of light toward the picture's edge; off: the photographs are
    even already."""
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
    """An export, how it is built and lit, and what is photographed of it."""

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
    """A build without errors that gravity does not turn, before an ideal lens."""

    def stop_numbers(self) -> tuple[int, ...] | None:
        """The stops; None for all; InputError: they are no list of numbers."""
        return None if self.stops is None else numbers(self.stops)

    def phase_names(self) -> tuple[str, ...] | None:
        """The phases; None for all."""
        if self.phases is None:
            return None
        return tuple(part.strip() for part in self.phases.split(","))
