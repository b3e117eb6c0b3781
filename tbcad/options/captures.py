"""Calls about light fields: written for other programs."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

import typer

from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.shared import AnyPath, Capture, Force, OutReplaced

Target = Literal["nerfstudio", "colmap", "ngp-rays", "rays", "mitsuba"]
AS_CAPTURED: tuple[Target, ...] = ("ngp-rays", "rays")
SIZES_PX = (8, 4096)


@dataclass(frozen=True)
class ExportOptions(Call):
    """A capture, for which program it is written, and what of it."""

    capture: Capture[AnyPath]
    to: Annotated[
        Target | None,
        typer.Option(
            help="nerfstudio, colmap: virtual cameras as pinholes, with masks; ngp-rays: crops "
            "with the ray of every pixel for instant-ngp; rays: all rays as numpy arrays and HDF5; "
            "mitsuba: the machine itself as scenes for Mitsuba and Blender."
        ),
    ] = None
    _: KW_ONLY
    out: OutReplaced[AnyPath] = Path("data")
    every: Annotated[
        int,
        typer.Option(min=1, metavar="N", help="One virtual camera of N, spread evenly."),
    ] = 1
    size: Annotated[
        int | None,
        typer.Option(
            metavar="PIXELS",
            help="Width and height of the pictures; by default as fine as the finest tenth of the "
            "virtual cameras.",
        ),
    ] = None
    cameras: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="a, b, or mirrors by name, as a0001,b0007; by default all.",
        ),
    ] = None
    exports: Annotated[
        AnyPath | None,
        typer.Option(
            "--exports",
            metavar="FOLDER",
            help="Folder written by tbcad build, with the shells; for --to mitsuba.",
        ),
    ] = None
    force: Force = False

    def check(self) -> Target:
        """Refuse what does not go together; the program.

        Raises:
            InputError: there is none, an option is not for it, or a number is out of range.
        """
        if self.to is None:
            allowed = ", ".join(get_args(Target))
            raise InputError(f"--to is missing, allowed is one of {allowed}: add it")
        if (self.to == "mitsuba") != (self.exports is not None):
            raise InputError(
                "--to mitsuba shows the shells of an export: give its folder by --exports"
                if self.exports is None
                else f"--exports {self.exports} is for --to mitsuba: leave it out"
            )
        if self.to == "mitsuba" and (self.size, self.cameras, self.every) != (None, None, 1):
            raise InputError(
                "--to mitsuba writes the whole machine: leave out --size, --cameras and --every"
            )
        if self.size is not None and self.to in AS_CAPTURED:
            raise InputError(
                f"--size {self.size}: {self.to} keeps every pixel as it was captured: "
                "leave it out, or choose --to nerfstudio or colmap"
            )
        low, high = SIZES_PX
        if self.size is not None and not low <= self.size <= high:
            raise InputError(f"--size {self.size} is not allowed: from {low} to {high} pixels")
        return self.to
