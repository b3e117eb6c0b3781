"""Drawing in a process of its own: without a proper screen the library ends the process."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tbcad.errors import InputError
from tbcad.output.manifest import read_manifest, written_file
from tbcad.output.single_files import check_file

SHELL = "shell"
CLOSE_UPS = ("edges", "seam")
PROTOTYPE = ("rig", "sides", "base", "seat", "exploded")
# Programs of this room by what they draw.
SUBJECTS = {SHELL: "shell_pictures"} | dict.fromkeys(CLOSE_UPS, "close_ups")
SUBJECTS |= dict.fromkeys(PROTOTYPE, "prototype_pictures")
SHELL_FILES = ("design.json", "mirrors.csv", "shell_a.stl", "shell_b.stl")
PROTOTYPE_FILES = ("prototype.json", "balls.csv")
MESHES = (".stl", ".glb")


def picture(folder: Path, file: Path, subject: str = SHELL, force: bool = False) -> None:
    """Draw one of SUBJECTS of a build to a PNG file, which is replaced atomically.

    InputError: the build or a screen is missing, a file of the build is not as it was written,
    the picture exists, or drawing fails.
    """
    if subject not in SUBJECTS:
        raise InputError(f"{subject!r} cannot be drawn: name one of {', '.join(SUBJECTS)}")
    check_drawn_files(folder, subject)
    if file.suffix.lower() != ".png" or not file.parent.is_dir():
        raise InputError(f"{file}: name a .png file in a folder that exists")
    check_file(file, force)
    with tempfile.TemporaryDirectory(dir=file.parent, prefix=".tbcad-picture-") as place:
        drawn = Path(place) / "picture.png"
        draw_apart(SUBJECTS[subject], str(folder), subject, str(drawn))
        if not drawn.is_file():
            raise InputError("drawing failed (no picture): see tbcad doctor")
        drawn.replace(file)


def check_drawn_files(folder: Path, subject: str = PROTOTYPE[0]) -> None:
    """Refuse a build that lacks a file that is drawn, or in which it is not as it was written."""
    manifest = read_manifest(folder)
    part, needed = "shell", [*SHELL_FILES]
    if subject in PROTOTYPE:
        meshes = (name for name in (manifest.files if manifest else ()) if name.endswith(MESHES))
        part = "prototype"
        needed = [*PROTOTYPE_FILES, *(name for name in meshes if name not in SHELL_FILES)]
    for name in needed:
        written_file(
            folder, manifest, name, f"name a folder that tbcad build wrote with its {part}"
        )


def draw_apart(module: str, *arguments: str) -> None:
    """Run a module of tbcad.report in a process of its own, under a virtual screen where needed.

    InputError: there is no screen, or drawing fails.
    """
    command = [sys.executable, "-m", f"tbcad.report.{module}", *arguments]
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        virtual = shutil.which("xvfb-run")
        if virtual is None:
            raise InputError(
                "pictures need a screen, or a virtual one: install it (Debian: apt-get install "
                "xvfb xauth libgl1-mesa-dri) and try again"
            )
        command = [virtual, "-a", *command]
    done = subprocess.run(
        command, capture_output=True, encoding="utf-8", errors="replace", check=False
    )
    if done.returncode != 0:
        last = (done.stderr.strip() or "the process crashed").splitlines()[-1]
        raise InputError(f"drawing failed ({last[:200]}): see tbcad doctor")
