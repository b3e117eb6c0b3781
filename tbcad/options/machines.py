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
    ExportsOption,
    Force,
    ForceFile,
    OutReplaced,
    PlotFormatOption,
    RunFolder,
)


@dataclass(frozen=True)
class CalibrateOptions(Call):
    """The photographs of a run, how the machine was made, and what of it was measured."""

    run: RunFolder[AnyPath]
    exports: Annotated[
        AnyPath, typer.Option("--exports", metavar="FOLDER", help="Folder written by tbcad build.")
    ] = Path("exports")
    _: KW_ONLY
    out: OutReplaced[AnyPath] = Path("calibration")
    process: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How the prototype is made: fdm, sls, sla, cnc, diamond, or a TOML file. By "
            "default fdm.",
        ),
    ] = None
    settings: Annotated[
        Sequence[str],
        typer.Option(
            "--set", metavar="KIND=VALUE", help="Change any error of the process; repeatable."
        ),
    ] = ()
    measured: Annotated[
        Sequence[str],
        typer.Option(
            metavar="BALL=MM",
            help="Measured radius of a ball or cap, 1=43.21, with its standard deviation in mm "
            "1=43.21:0.005, by default 0.01 mm; repeatable.",
        ),
    ] = ()
    intrinsics: Annotated[
        AnyPath | None,
        typer.Option(
            metavar="FILE",
            help="Lens of the camera as OpenCV (YAML, XML), ROS, Kalibr (YAML), mrcal "
            "(.cameramodel), COLMAP (cameras.txt) or tbcad intrinsics wrote it. By default the "
            "lens is estimated too.",
        ),
    ] = None
    plot: PlotFormatOption = "png"
    force: Force = False


@dataclass(frozen=True)
class IntrinsicsOptions(Call):
    """Photographs of a board, and its measures."""

    folder: Annotated[
        AnyPath, typer.Argument(metavar="FOLDER", help="Photographs of a board, one camera.")
    ]
    _: KW_ONLY
    squares: Annotated[
        str, typer.Option(metavar="WxH", help="Squares of the board, columns x rows.")
    ] = "9x6"
    size: Annotated[float, typer.Option(min=0.1, max=1000, help="Width of a square, mm.")] = 5.0
    charuco: Annotated[
        str | None,
        typer.Option(metavar="DICTIONARY", help="Markers of a ChArUco board, for instance 4x4_50."),
    ] = None
    marker: Annotated[
        float | None, typer.Option(metavar="MM", help="Width of a ChArUco board's markers, mm.")
    ] = None
    out: Annotated[
        AnyPath, typer.Option("--out", "-o", help="File to write, YAML as OpenCV writes it.")
    ] = Path("camera.yml")
    force: ForceFile = False


@dataclass(frozen=True)
class MergeOptions(Call):
    """A run, its calibration, and how photographs are corrected."""

    run: RunFolder[AnyPath]
    calibration: CalibrationFolder[AnyPath] = Path("calibration")
    exports: ExportsOption[AnyPath] = None
    _: KW_ONLY
    out: Annotated[
        AnyPath | None,
        typer.Option(
            "--out",
            "-o",
            help="Folder for all files; replaced as a whole or not at all. By default captures/ "
            "with the name of the run, such as captures/first.",
        ),
    ] = None
    vignetting: Annotated[
        Literal["off", "cos4"],
        typer.Option(
            help="cos4: make good the natural loss of light toward the picture's edge; off: the "
            "photographs are even already."
        ),
    ] = "cos4"
    flat: Annotated[
        Sequence[AnyPath],
        typer.Option(
            metavar="FILE",
            help="Photograph of an even surface, in place of --vignetting; repeatable, the mean "
            "counts.",
        ),
    ] = ()
    encoding: Annotated[
        Literal["linear", "srgb"],
        typer.Option(
            help="linear: numbers of the photographs are proportional to light, as of raw "
            "pictures; srgb: as in a camera's JPEGs."
        ),
    ] = "linear"
    brightness: Annotated[
        float, typer.Option(min=1e-3, max=1e3, help="Factor of the light of all pixels.")
    ] = 1.0
    force: Force = False

    @property
    def folder(self) -> Path:
        """Of the files."""
        return Path(self.out or Path("captures") / Path(self.run).resolve().name)


@dataclass(frozen=True)
class AsBuiltOptions(Call):
    """A calibrated prototype."""

    calibration: Annotated[
        AnyPath, typer.Argument(metavar="FOLDER", help="Folder written by tbcad calibrate.")
    ]
    exports: ExportsOption[AnyPath] = None
    _: KW_ONLY
    out: OutReplaced[AnyPath] = Path("asbuilt")
    force: Force = False
