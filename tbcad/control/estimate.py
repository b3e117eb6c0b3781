"""How long a run takes and how much disk it needs, before it starts."""

import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from tbcad.control.base import travel_s
from tbcad.control.plan import Plan
from tbcad.errors import InputError
from tbcad.records.exposure import Frame

SIDECAR_BYTES = 8_192  # with the journal's line, as a disk's blocks count them
SPARE = 1.1  # of disk: a lit object takes more bytes than the dark
LEAST_BYTES_PER_PX = 0.3  # of a lit object as a JPEG: the first photograph may be a dark one
CAPTURE_S = 2.0  # of a camera that is not yet known, beyond its exposure
BYTES_PER_PX = 1.0  # likewise: a large JPEG; dark photographs take less
WRITE_S = 0.03  # a photograph to the disk
MINUTE, HOUR = 60, 3600


@dataclass(frozen=True)
class Shots:
    """Photographs that are still to be taken at one position.

    Attributes:
        frame: the position.
        phases: names of their lights, in order.
    """

    frame: Frame
    phases: tuple[str, ...]

    @property
    def title(self) -> str:
        """The position in words."""
        run = "b" if self.frame.object_turn_deg else "a"
        return f"run {run}, stop {self.frame.stop} at {self.frame.base_angle_deg:.1f} degrees"


def expected_seconds(plan: Plan, remaining: Iterable[Shots], capture_s: float) -> dict[str, float]:
    """Expected duration of each position, s, by its title."""
    each = plan.motion.light_s + capture_s + WRITE_S
    return {
        shots.title: travel + plan.motion.settle_s + len(shots.phases) * each
        for shots, travel in _with_travel(plan, remaining)
    }


def _with_travel(plan: Plan, remaining: Iterable[Shots]) -> Iterator[tuple[Shots, float]]:
    for _, run in groupby(remaining, lambda shots: shots.frame.object_turn_deg):
        at = plan.program.start.angle_deg
        for shots in run:
            angle = shots.frame.base_angle_deg
            yield shots, travel_s(abs(angle - at), plan)
            at = angle


def count(remaining: Iterable[Shots]) -> int:
    """Number of photographs."""
    return sum(len(shots.phases) for shots in remaining)


def disk_bytes(photographs: int, each: float) -> int:
    """Room that photographs need on the disk."""
    return round(photographs * (SPARE * each + SIDECAR_BYTES))


def bytes_each(first: int, width_px: int, height_px: int) -> float:
    """Size of a photograph by that of the first."""
    return max(float(first), LEAST_BYTES_PER_PX * width_px * height_px)


def free_bytes(folder: Path) -> int:
    """Free room where a folder is or will be."""
    absolute = folder.absolute()
    existing = next(path for path in (absolute, *absolute.parents) if path.exists())
    return shutil.disk_usage(existing).free


def check_disk(folder: Path, needed: int) -> None:
    """Refuse a disk with too little room.

    Raises:
        InputError: it has.
    """
    if (free := free_bytes(folder)) < needed:
        raise InputError(
            f"{folder}: the photographs need about {size_text(needed)}, {size_text(free)} are "
            "free: make room, or name a folder on another disk"
        )


def duration_text(seconds: float) -> str:
    """A duration in hours and minutes, or in seconds if it is short."""
    if seconds < MINUTE:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / MINUTE), HOUR // MINUTE)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def size_text(size: float) -> str:
    """A number of bytes in MB or GB."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"
