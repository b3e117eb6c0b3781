"""Drawing in a process of its own: without a proper screen the library ends the process."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tbcad.errors import InputError

SHELL = "shell"
PROTOTYPE = ("rig", "base", "seat", "exploded")
SUBJECTS = (SHELL, *PROTOTYPE)
SHELL_FILES = ("mirrors.csv", "shell_a.stl", "shell_b.stl")
PROTOTYPE_FILES = ("prototype.json", "balls.csv")


def picture(folder: Path, file: Path, subject: str = SHELL) -> None:
    """Draw a subject of an export to a PNG file, which is replaced as a whole.

    Args:
        folder: an export.
        file: picture to write.
        subject: one of SUBJECTS.

    Raises:
        InputError: when the export or a screen is missing, or drawing fails.
    """
    if subject not in SUBJECTS:
        raise InputError(f"{subject!r} cannot be drawn: name one of {', '.join(SUBJECTS)}")
    required = SHELL_FILES if subject == SHELL else PROTOTYPE_FILES
    missing = [name for name in required if not (folder / name).is_file()]
    if missing:
        raise InputError(
            f"{folder}: {missing[0]} is missing: name a folder that tbcad build wrote with its "
            f"{'shell' if subject == SHELL else 'prototype'}"
        )
    if file.suffix.lower() != ".png" or not file.parent.is_dir():
        raise InputError(f"{file}: name a .png file in a folder that exists")
    with tempfile.TemporaryDirectory(dir=file.parent, prefix=".tbcad-picture-") as place:
        drawn = Path(place) / "picture.png"
        done = subprocess.run(
            child_command(folder, drawn, subject), capture_output=True, text=True, check=False
        )
        if done.returncode != 0 or not drawn.is_file():
            last = (done.stderr.strip() or "the process crashed").splitlines()[-1]
            raise InputError(f"drawing failed ({last[:200]}): see tbcad doctor")
        drawn.replace(file)


def child_command(folder: Path, picture: Path, subject: str = SHELL) -> list[str]:
    """The command that draws in a process of its own, under a virtual screen where needed.

    Raises:
        InputError: when there is neither a screen nor a virtual one.
    """
    module, what = ("shell_pictures", []) if subject == SHELL else ("prototype_pictures", [subject])
    command = [sys.executable, "-m", f"tbcad.report.{module}", str(folder), *what, str(picture)]
    if os.environ.get("DISPLAY") or sys.platform != "linux":
        return command
    virtual = shutil.which("xvfb-run")
    if virtual is None:
        raise InputError(
            "pictures need a screen, or a virtual one: install it (Debian: apt-get install xvfb "
            "xauth libgl1-mesa-dri) and try again"
        )
    return [virtual, "-a", *command]
