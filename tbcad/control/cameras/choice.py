"""Which camera --camera names."""

from pathlib import Path

from tbcad.control.cameras.camera import Camera
from tbcad.control.cameras.command import EXPOSURES, CommandCamera
from tbcad.control.cameras.gphoto import GphotoCamera
from tbcad.control.cameras.watched_folder import WatchedFolder
from tbcad.errors import InputError
from tbcad.records.exposure import PhaseTimes

GPHOTO, COMMAND, FOLDER = "gphoto2", "command:", "folder:"


def check_camera_name(text: str) -> None:
    """Refuse a text that names no kind of camera.

    Raises:
        InputError: it does not.
    """
    if text == GPHOTO or any(text.startswith(kind) and text != kind for kind in (COMMAND, FOLDER)):
        return
    raise InputError(
        f"--camera is {text!r:.60}, allowed is gphoto2, command:PROGRAM ARGUMENTS with {{output}} "
        "for the image's path, or folder:PATH"
    )


def check_can_expose(text: str, times: PhaseTimes) -> None:
    """Refuse exposure times that a kind of camera cannot be told, and commands that lack theirs.

    Raises:
        InputError: see above.
    """
    asked, told = times != PhaseTimes(), any(field in text for field in EXPOSURES)
    if asked and text.startswith(FOLDER):
        raise InputError(
            "--camera folder: cannot be told an exposure: leave --exposure-leds and --exposure-lit "
            "out and photograph two runs, one with --phases dark,leds and, with the camera's "
            "exposure changed, one with --phases dark,lit into another folder; or use gphoto2"
        )
    if asked and text.startswith(COMMAND) and not told:
        raise InputError(
            f"--camera command: has none of {', '.join(EXPOSURES)}: put one where the exposure "
            "belongs, for example command:rpicam-still -n --shutter {exposure_us} -o {output}.jpg"
        )
    if told and not asked:
        raise InputError(
            "--camera command: asks for an exposure: say --exposure-leds and --exposure-lit"
        )


def connected_camera(text: str, timeout_s: float) -> Camera:
    """The camera that a text names.

    Args:
        text: gphoto2, command:... or folder:...
        timeout_s: how long a photograph may take.

    Raises:
        InputError: there is none.
    """
    check_camera_name(text)
    if text.startswith(COMMAND):
        return CommandCamera(text.removeprefix(COMMAND), timeout_s)
    if text.startswith(FOLDER):
        return WatchedFolder(Path(text.removeprefix(FOLDER)), timeout_s)
    return GphotoCamera()
