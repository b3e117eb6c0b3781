"""Drawing in a process of its own: without a proper screen the library ends the process."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tbcad.errors import InputError

NEEDED = ("mirrors.csv", "shell_a.stl", "shell_b.stl")


def picture(folder: Path, file: Path) -> None:
    """Draw both halves of an export to a PNG file, which is replaced as a whole.

    Raises:
        InputError: when the export or a screen is missing, or drawing fails.
    """
    missing = [name for name in NEEDED if not (folder / name).is_file()]
    if missing:
        raise InputError(f"{folder}: {missing[0]} is missing: name a folder that tbcad build wrote")
    if file.suffix.lower() != ".png" or not file.parent.is_dir():
        raise InputError(f"{file}: name a .png file in a folder that exists")
    with tempfile.TemporaryDirectory(dir=file.parent, prefix=".tbcad-picture-") as place:
        drawn = Path(place) / "picture.png"
        done = subprocess.run(
            child_command(folder, drawn), capture_output=True, text=True, check=False
        )
        if done.returncode != 0 or not drawn.is_file():
            last = (done.stderr.strip() or "the process crashed").splitlines()[-1]
            raise InputError(f"drawing failed ({last[:200]}): see tbcad doctor")
        drawn.replace(file)


def child_command(folder: Path, picture: Path) -> list[str]:
    """The command that draws in a process of its own, under a virtual screen where needed.

    Raises:
        InputError: when there is neither a screen nor a virtual one.
    """
    command = [sys.executable, "-m", "tbcad.report.pictures", str(folder), str(picture)]
    if os.environ.get("DISPLAY") or sys.platform != "linux":
        return command
    virtual = shutil.which("xvfb-run")
    if virtual is None:
        raise InputError(
            "pictures need a screen, or a virtual one: install it (Debian: apt-get install xvfb "
            "xauth libgl1-mesa-dri) and try again"
        )
    return [virtual, "-a", *command]
