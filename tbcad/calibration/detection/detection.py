"""What a detection gives: the highlights to calibrate from, and what was not used, and why.

`tbcad.calibration.detection.detect.detect(run, prior)` makes it of a run that
tbcad.runs.photographs has read, and of the prior of its machine, whose frames are those of the
run's record in the same order.
"""

from dataclasses import dataclass
from enum import StrEnum

from tbcad.machine.machine import Highlights


class Reason(StrEnum):
    """Why a highlight is not used."""

    NO_PHOTOGRAPH = "no photograph"
    OUTSIDE = "outside of the picture"
    HIDDEN = "hidden, or partly"
    MISSING = "not found where it was expected"
    DOUBLE = "two highlights where one was expected"
    MERGED = "merged with another highlight"
    FAINT = "too faint: a reflection of a reflection, or nearly hidden"
    SATURATED = "saturated"
    MOVED = "the camera moved"


@dataclass(frozen=True)
class Rejected:
    """A highlight that is not used.

    Attributes:
        frame: from 0.
        sphere: from 0.
        led: from 0.
        reason: why.
    """

    frame: int
    sphere: int
    led: int
    reason: Reason


@dataclass(frozen=True)
class Detection:
    """The result of a detection.

    Attributes:
        highlights: that can be used; their pixels are where the LEDs' own positions appear, the
            centroids' offsets from that taken off.
        rejected: highlights that were expected and are not used, each once.
        faults: of photographs, LEDs and frames, each in one line that names what, and what is done.
    """

    highlights: Highlights
    rejected: tuple[Rejected, ...]
    faults: tuple[str, ...]
