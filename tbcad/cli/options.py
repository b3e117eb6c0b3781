"""Options that several commands of the simulation have."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

Capture = Annotated[Path, typer.Argument(help="Folder written by tbcad capture.")]
Azimuth = Annotated[float, typer.Option(help="About z from x, degrees.")]
Elevation = Annotated[float, typer.Option(help="Above the object's horizon, 0 to 90 degrees.")]
Distance = Annotated[float, typer.Option(help="From the middle of the object, mm.")]
Width = Annotated[int, typer.Option(min=16, max=8192, help="Columns of the picture.")]
Height = Annotated[int, typer.Option(min=16, max=8192, help="Rows of the picture.")]
Fov = Annotated[
    float | None,
    typer.Option(help="Angle of view across, degrees; without, the capture sphere fills it."),
]


class Paint(StrEnum):
    """The object's colours."""

    OWN = "own"
    PATTERN = "pattern"
    PLAIN = "plain"


PaintOption = Annotated[
    Paint,
    typer.Option(
        help="own: the file's colours or texture, a pattern where it has none; pattern; plain: "
        "grey."
    ),
]


class Method(StrEnum):
    """How wanted rays get their colours."""

    NEAREST = "nearest"
    BLEND = "blend"


ObjectFile = Annotated[
    Path | None,
    typer.Option(
        "--object",
        metavar="FILE",
        help="Triangle mesh (PLY, STL, OBJ, GLB ...) in mm, z up, about the origin, with vertex "
        "colours or a texture; without, a built-in knot.",
    ),
]
MethodOption = Annotated[
    Method,
    typer.Option(
        help="nearest: the nearest captured ray, as in the paper; blend: several virtual cameras "
        "that see the same point."
    ),
]


class Surface(StrEnum):
    """What a blend takes the object for."""

    PLANE = "plane"
    OBJECT = "object"


Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Dask scheduler, like tcp://host:8786 (pip install tbcad[cluster]); without, all "
        "cores of this machine.",
    ),
]
