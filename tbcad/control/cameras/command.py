"""A camera that a command of the user's operates: it writes one image file for each call."""

import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

from tbcad.control.cameras.camera import Shot
from tbcad.control.cameras.image_facts import suffix_of
from tbcad.control.faults import CameraFault
from tbcad.errors import InputError

PLACE = "{output}"
EXPOSURES = ("{exposure_s}", "{exposure_ms}", "{exposure_us}")
EXAMPLE = "for example command:rpicam-still -o {output}.jpg"
LONGEST_LINE = 200


class CommandCamera:
    """A command with `{output}` in the place of the image's path, without its suffix."""

    released = False

    def __init__(self, command: str, timeout_s: float) -> None:
        """Check a command; it is split as a shell splits it, and run without one.

        Raises:
            InputError: it cannot be split, names no output, or its program is not there.
        """
        try:
            self._words = shlex.split(command)
        except ValueError as error:
            raise InputError(f"--camera command: {error}: {EXAMPLE}") from None
        if PLACE not in command:
            raise InputError(f"--camera command: {PLACE} is missing: {EXAMPLE}")
        if shutil.which(self._words[0]) is None:
            raise InputError(f"--camera command: there is no program {self._words[0]}: install it")
        self._timeout_s = timeout_s
        self._exposure: dict[str, str] = {}

    def expose(self, seconds: float) -> None:
        """Give the command this time from now on."""
        texts = f"{seconds:.6f}", f"{seconds * 1e3:.3f}", f"{seconds * 1e6:.0f}"
        self._exposure = dict(zip(EXPOSURES, texts, strict=True))

    def expect(self) -> None:
        """Get ready: nothing to do."""

    def photograph(self) -> Shot:
        """Run the command; whatever file it wrote at the output is the photograph."""
        with tempfile.TemporaryDirectory(prefix="tbcad-") as folder:
            fields = self._exposure | {PLACE: str(Path(folder, "photograph"))}
            self._run([_filled(word, fields) for word in self._words])
            files = sorted(file for file in Path(folder).iterdir() if not file.name.startswith("."))
            if len(files) != 1:
                count = f"{len(files)} files" if files else "no file"
                raise CameraFault(f"the camera's command wrote {count} at {PLACE}, one is needed")
            return Shot(files[0].read_bytes(), suffix_of(files[0].name), {})

    def _run(self, words: list[str]) -> None:
        try:
            done = subprocess.run(
                words,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=self._timeout_s,
                check=False,
                encoding="utf-8",
                errors="replace",
            )
        except subprocess.TimeoutExpired:
            raise CameraFault(f"the camera's command took over {self._timeout_s:g} s") from None
        except OSError as error:
            raise CameraFault(f"the camera's command cannot be run: {error.strerror}") from None
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["it says nothing"])[-1]
            raise CameraFault(
                f"the camera's command ended with {done.returncode}: {last[:LONGEST_LINE]}"
            )

    def again(self) -> None:
        """Connect anew: nothing to do."""

    def close(self) -> None:
        """Give up: nothing to do."""


def _filled(word: str, fields: dict[str, str]) -> str:
    for field, text in fields.items():
        word = word.replace(field, text)
    return word
