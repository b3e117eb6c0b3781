"""The call that drives the machine and photographs it."""

import re
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from tbcad.common.screen import Stages
from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.shared import AnyPath, Exports, ExposureLeds, ExposureLit

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
