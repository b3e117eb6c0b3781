"""The export of the machine that was calibrated."""

from pathlib import Path

from tbcad.errors import InputError
from tbcad.formats.checked_files import parse_json
from tbcad.machine.shells import CAMERAS

CALIBRATION = "calibration.json"


def export_of(calibration: Path) -> Path:
    """The export that a calibration's record names.

    Raises:
        InputError: it names none.
    """
    folders = [calibration, *(calibration / name for name in CAMERAS)]
    path = next((one / CALIBRATION for one in folders if (one / CALIBRATION).is_file()), None)
    try:
        found = parse_json(path.read_text(encoding="utf-8"))["exports"] if path else None
    except (OSError, ValueError, KeyError, TypeError):
        found = None
    if not isinstance(found, str):
        raise InputError(f"{calibration} does not name its export: name it with --exports")
    return Path(found)
