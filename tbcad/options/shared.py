"""Options that several commands share, of places, pictures, exposure times and lists of stops."""

import math
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import typer

from tbcad.errors import InputError
from tbcad.options.call import tell_options

Place = TypeVar("Place")
Changes = Mapping[str, str] | Sequence[str]
AnyPath = Path | str | PathLike[str]  # such as a build, a run, a calibration

Design = Annotated[Place | None, typer.Argument(metavar="DESIGN")]
"""Design file (TOML), or the name of a design that comes with tbcad (tbcad init --list); by default
the design of the paper."""
Exports = Annotated[Place, typer.Argument(metavar="FOLDER")]
"""Folder written by tbcad build."""
Settings = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE")]
"""Change any key of the design; repeatable."""
Out = Annotated[Place, typer.Option("--out", "-o")]
"""Folder for the files; other files in it stay."""
OutReplaced = Annotated[Place, typer.Option("--out", "-o")]
"""Folder for all files; replaced atomically."""
OutPicture = Annotated[Place, typer.Option("--out", "-o")]
"""PNG file to write."""
JsonResult = Annotated[bool, typer.Option("--json")]
"""Print what is found as JSON, for other programs."""
Force = Annotated[bool, typer.Option("--force")]
"""Replace what may have cost hours (a capture, a merged run, a calibration, a build that a run
photographed), and keep files in the folder that tbcad did not write, instead of refusing."""
ForceFile = Annotated[bool, typer.Option("--force")]
"""Replace files that exist, instead of refusing."""
Capture = Annotated[Place, typer.Argument(metavar="FOLDER")]
"""Folder written by tbcad capture."""
RunFolder = Annotated[Place, typer.Argument(metavar="RUN")]
"""Folder written by tbcad run or simulate-run."""
ExportsOption = Annotated[Place | None, typer.Option("--exports", metavar="FOLDER")]
"""Folder written by tbcad build; by default the one that the calibration names."""
CalibrationFolder = Annotated[Place, typer.Option("--calibration", metavar="FOLDER")]
"""Folder written by tbcad calibrate."""
Azimuth = Annotated[float, typer.Option()]
"""Azimuth of the camera about z, from x, degrees."""
Elevation = Annotated[float, typer.Option()]
"""Elevation of the camera, 0 to 90 degrees."""
Distance = Annotated[float, typer.Option()]
"""Distance of the camera from the centre of the object, mm."""
Width = Annotated[int, typer.Option(min=16, max=8192)]
"""Width of the picture, pixels."""
Height = Annotated[int, typer.Option(min=16, max=8192)]
"""Height of the picture, pixels."""
PaintOption = Annotated[Literal["own", "pattern", "plain"], typer.Option()]
"""own: colours or texture of the file, or a pattern where it has none; pattern: always the pattern;
plain: grey."""
ObjectFile = Annotated[Place | None, typer.Option("--object", metavar="FILE")]
"""Triangle mesh (PLY, STL, OBJ, OFF, GLB, glTF, 3MF) about the origin, with its colours or
textures; by default a built-in knot."""
UpOption = Annotated[Literal["y", "z"] | None, typer.Option("--up")]
"""The axis of the object's file that points up; by default y for GLB and glTF, else z."""
UnitOption = Annotated[Literal["mm", "cm", "m", "in"] | None, typer.Option("--unit")]
"""Of the object's file; by default m for GLB and glTF, what a 3MF says, else mm."""
PlotFormatOption = Annotated[Literal["svg", "png", "pdf"], typer.Option("--format")]
"""Of plots: svg and pdf have lines and text at any size, png has pixels."""
METHODS = (
    "nearest: the colour of the nearest captured ray, as in the paper; depth: the mean of several "
    "virtual cameras at the depth that the light field itself shows"
)
MethodOfStudy = Annotated[
    Literal["nearest", "depth", "field"],
    typer.Option(help=f"{METHODS}; field: a coarse field that is fitted to all rays in seconds."),
]
MethodOfView = Annotated[
    Literal["nearest", "depth", "field"] | None,
    typer.Option(
        help=f"{METHODS}; field: the field of tbcad reconstruct. By default field where field.npz "
        "is in the capture's folder, else depth."
    ),
]
Scheduler = Annotated[str | None, typer.Option(metavar="ADDRESS")]
"""Dask scheduler, for example tcp://host:8786 (pip install 'tbcad[cluster]'); by default all
cores of this machine."""


Time = TypeVar("Time")
SHORTEST_S, LONGEST_S = 1e-6, 3600.0
MOST_STOPS = 1_000_000  # as a run's record may have

ExposureLeds = Annotated[Time | None, typer.Option("--exposure-leds", metavar="S")]
"""Exposure of the photographs by LEDs and in the dark, s, such as 1/60; --exposure-lit alone is for
all."""
ExposureLit = Annotated[Time | None, typer.Option("--exposure-lit", metavar="S")]
"""Exposure of the photographs of the lit object, s, such as 0.5; --exposure-leds alone is for
all."""


def exposures(
    leds: str | float | None, lit: str | float | None
) -> tuple[float | None, float | None]:
    """Exposure by LEDs and of the lit object, s, of numbers or fractions as cameras show them.

    InputError: one is neither, or no time of an exposure.
    """
    return _seconds("--exposure-leds", leds), _seconds("--exposure-lit", lit)


def _seconds(option: str, given: str | float | None) -> float | None:
    if given is None:
        return None
    text = str(given)
    above, slash, below = text.partition("/")
    try:
        found = float(above) / (float(below) if slash else 1.0)
    except (ValueError, ZeroDivisionError):
        found = math.nan
    if not SHORTEST_S <= found <= LONGEST_S:
        raise InputError(
            f"{option} is {text!r:.40}, allowed are {SHORTEST_S:g} to {LONGEST_S:g} s, as 0.5 "
            "or 1/60: change it"
        )
    return found


def numbers(text: str) -> tuple[int, ...]:
    """Whole numbers of a list as 1,5,20-30; InputError: it is none."""
    found: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition("-")
        try:
            chosen = range(int(first), int(last or first) + 1)
            if not 1 <= len(chosen) <= MOST_STOPS:
                raise ValueError
            found.update(chosen)
        except ValueError:
            raise InputError(
                f"--stops {text!r:.60}: {part.strip()!r:.20} is no stop or range of stops: write "
                "for instance 1,5,20-30"
            ) from None
    return tuple(sorted(found))


tell_options(__name__)
