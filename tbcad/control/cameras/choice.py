"""Which camera --camera names."""

from pathlib import Path

from tbcad.control.cameras.camera import Camera
from tbcad.control.cameras.command import CommandCamera
from tbcad.control.cameras.gphoto import GphotoCamera
from tbcad.control.cameras.watched_folder import WatchedFolder
from tbcad.errors import InputError

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
