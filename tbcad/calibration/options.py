"""What a calibration may be told besides the run and its export."""

from dataclasses import dataclass
from pathlib import Path

from tbcad.figure_files import PlotFormat

DEFAULT_PROCESS = "fdm"
"""A prototype is printed; its design does not say how."""


@dataclass(frozen=True)
class CalibrationOptions:
    """How the machine was made, and what of it was measured.

    Attributes:
        process: built-in process or TOML file; None for DEFAULT_PROCESS.
        settings: "kind=value" texts that change errors of the process.
        measured: radii of spheres, "BALL=MM" or "BALL=MM:SIGMA".
        intrinsics: file of the camera's lens; None to estimate the lens too.
    """

    process: str | None = None
    settings: tuple[str, ...] = ()
    measured: tuple[str, ...] = ()
    intrinsics: Path | None = None
    plot: PlotFormat = "png"

    @property
    def process_words(self) -> str:
        """The process, and whether it is the default."""
        return self.process or f"{DEFAULT_PROCESS} (the default)"
