"""What a run asks of a camera."""

import math
import re
from dataclasses import dataclass
from typing import Protocol

from tbcad.records.exposure import Setting

NEAR = 1.5  # factor of exposure times: the coarsest cameras have steps of 2
_TIME = re.compile(r"(\d+(?:\.\d+)?)(?:/(\d+(?:\.\d+)?))?\s*s?$")


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
