"""Which camera --camera names."""

import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep

from tbcad.cad.formats.pictures import visible_files
from tbcad.errors import InputError
from tbcad.records.run import PhaseTimes
from tbcad.rig.control.camera import RunCamera, Shot, image_facts, suffix_of
from tbcad.rig.control.gphoto import GphotoCamera
from tbcad.rig.control.plan import CameraFault

PLACE = "{output}"
EXPOSURES = ("{exposure_s}", "{exposure_ms}", "{exposure_us}")
EXAMPLE = "for example command:rpicam-still -o {output}.jpg"
LONGEST_LINE = 200
POLL_S = 0.05
QUIET_S = 0.3  # a file that has not grown for so long, and can be read, is complete
GPHOTO, COMMAND, FOLDER = "gphoto2", "command:", "folder:"


class CommandCamera(RunCamera):
    """A command with `{output}` in the place of the image's path, without its suffix."""

    released = False

    def __init__(self, command: str, timeout_s: float) -> None:
        """Check a command; it is split as a shell splits it, and run without one."""
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


def _filled(word: str, fields: dict[str, str]) -> str:
    for field, text in fields.items():
        word = word.replace(field, text)
    return word


class WatchedFolder(RunCamera):
    """The new file that appears after a release is the photograph."""

    def __init__(
        self, folder: Path, timeout_s: float, clock: Callable[[], float] = monotonic
    ) -> None:
        """Watch a folder."""
        if not folder.is_dir():
            raise InputError(f"--camera folder:{folder}: there is no such folder: make it first")
        self._folder, self._timeout_s, self._clock = folder, timeout_s, clock
        self._known: set[str] = set()
        self.released = True

    def expose(self, seconds: float) -> None:
        """Refuse: a relay tells a camera nothing."""
        raise CameraFault(f"a camera on a relay cannot be told to expose for {seconds:g} s")

    def expect(self) -> None:
        """Remember which files are there."""
        self._known = self._names()

    def photograph(self) -> Shot:
        """Wait until a new file is there and complete."""
        end, sizes = self._clock() + self._timeout_s, dict[str, tuple[int, float]]()
        fault = f"no photograph came into {self._folder} within {self._timeout_s:g} s"
        while self._clock() < end:
            new = sorted(self._names() - self._known)
            if len(new) > 1:
                raise CameraFault(f"{len(new)} photographs came into {self._folder}, not one")
            if new and self._rests(self._folder / new[0], sizes):
                data, suffix = (self._folder / new[0]).read_bytes(), suffix_of(new[0])
                try:
                    image_facts(data, suffix)
                except CameraFault as error:  # more of it may come
                    fault = str(error)
                else:
                    return Shot(data, suffix, {})
            sleep(POLL_S)
        raise CameraFault(fault)

    def _rests(self, path: Path, sizes: dict[str, tuple[int, float]]) -> bool:
        """Whether a file has had its size for a while."""
        try:
            size, now = path.stat().st_size, self._clock()
        except FileNotFoundError:
            return False
        before, since = sizes.setdefault(path.name, (size, now))
        if size != before:
            sizes[path.name] = (size, now)
            return False
        return size > 0 and now - since >= QUIET_S

    def _names(self) -> set[str]:
        try:
            return {path.name for path in visible_files(self._folder)}
        except OSError as error:
            raise CameraFault(f"{self._folder} cannot be read: {error.strerror}") from None


def check_camera_name(text: str) -> None:
    """Refuse a text that names no kind of camera."""
    if text == GPHOTO or any(text.startswith(kind) and text != kind for kind in (COMMAND, FOLDER)):
        return
    raise InputError(
        f"--camera is {text!r:.60}, allowed is gphoto2, command:PROGRAM ARGUMENTS with {{output}} "
        "for the image's path, or folder:PATH"
    )


def check_can_expose(text: str, times: PhaseTimes) -> None:
    """Refuse exposure times that a camera cannot be told, and commands that lack theirs."""
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


def connected_camera(text: str, timeout_s: float) -> RunCamera:
    """The camera that a text names, whose photographs may take so long."""
    check_camera_name(text)
    if text.startswith(COMMAND):
        return CommandCamera(text.removeprefix(COMMAND), timeout_s)
    if text.startswith(FOLDER):
        return WatchedFolder(Path(text.removeprefix(FOLDER)), timeout_s)
    return GphotoCamera()
