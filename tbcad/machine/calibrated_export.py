"""The export of the machine that was calibrated."""

from pathlib import Path

from tbcad.errors import InputError
from tbcad.machine.shells import CAMERAS
from tbcad.records.calibration import NAME, CalibrationRecord


def export_of(calibration: Path) -> Path:
    """The export that a calibration's record names.

    Raises:
        InputError: it names none.
    """
    files = [one / NAME for one in (calibration, *(calibration / name for name in CAMERAS))]
    try:
        return Path(CalibrationRecord.read(next(filter(Path.is_file, files), files[0])).exports)
    except InputError:
        raise InputError(
            f"{calibration} does not name its export: name it with --exports"
        ) from None
