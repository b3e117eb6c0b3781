"""What `tbcad export` is asked for."""

from dataclasses import dataclass
from typing import Literal

from tbcad.errors import InputError

Target = Literal["nerfstudio", "colmap", "ngp-rays", "rays", "mitsuba"]
AS_CAPTURED: tuple[Target, ...] = ("ngp-rays", "rays")
SIZES_PX = (8, 4096)


@dataclass(frozen=True)
class ExportOptions:
    """Options of an export.

    Attributes:
        target: for which program.
        every: one virtual camera of so many, spread evenly.
        cameras: cameras and mirrors by name, apart by commas; None: all.
        size_px: width and height of the pictures; None: as fine as the capture.
    """

    target: Target
    every: int = 1
    cameras: str | None = None
    size_px: int | None = None

    def __post_init__(self) -> None:
        """Refuse what does not go together.

        Raises:
            InputError: a size for pixels that stay as captured, or a number out of range.
        """
        if self.target == "mitsuba" and (self.size_px, self.cameras, self.every) != (None, None, 1):
            raise InputError(
                "--to mitsuba writes the whole machine: leave out --size, --cameras and --every"
            )
        if self.size_px is not None and self.target in AS_CAPTURED:
            raise InputError(
                f"--size {self.size_px}: {self.target} keeps every pixel as it was captured: "
                "leave it out, or choose --to nerfstudio or colmap"
            )
        low, high = SIZES_PX
        if self.size_px is not None and not low <= self.size_px <= high:
            raise InputError(f"--size {self.size_px} is not allowed: from {low} to {high} pixels")
        if self.every < 1:
            raise InputError(f"--every {self.every} is not allowed: 1 or more")
