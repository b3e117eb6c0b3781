"""Cameras that --camera names: a command, a folder, or one on USB by libgphoto2's own protocol.

Sources: python-gphoto2 2.6 (examples/capture-image.py, camera-config-values.py); libgphoto2
camlibs/ptp2/config.c for the names of the settings.
"""

import math
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from time import monotonic, sleep
from types import ModuleType
from typing import Any

from tbcad.cad.formats.pictures import visible_files
from tbcad.errors import InputError
from tbcad.records.run import PhaseTimes, Setting
from tbcad.rig.control.messages import INSTALL
from tbcad.rig.control.photographs import (
    RunCamera,
    Shot,
    are_near,
    image_facts,
    shutter_seconds,
    suffix_of,
)
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
            words = self._words
            for name, text in fields.items():
                words = [word.replace(name, text) for word in words]
            self._run(words)
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


class WatchedFolder(RunCamera):
    """The new file that appears after a release is the photograph."""

    def __init__(self, folder: Path, timeout_s: float) -> None:
        """Watch a folder."""
        if not folder.is_dir():
            raise InputError(f"--camera folder:{folder}: there is no such folder: make it first")
        self._folder, self._timeout_s = folder, timeout_s
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
        end, sizes = monotonic() + self._timeout_s, dict[str, tuple[int, float]]()
        fault = f"no photograph came into {self._folder} within {self._timeout_s:g} s"
        while monotonic() < end:
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
            size, now = path.stat().st_size, monotonic()
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


# What must not change in a run; a camera has some of them.
LOCKED = (
    *("shutterspeed", "shutterspeed2", "aperture", "f-number", "iso", "autoiso"),
    *("whitebalance", "colortemperature", "exposurecompensation", "expprogram"),
    *("autoexposuremode", "focusmode", "focusmode2"),
    *("imagesize", "imageformat", "imagequality"),
)
FOCUS, MANUAL = ("focusmode", "focusmode2"), "manual"
SHUTTERS = ("shutterspeed", "shutterspeed2")
MANUAL_EXPOSURE = "set the camera to manual exposure"
AUTOFOCUS, OFF = "autofocus", "Off"  # of the driver, before each release


class GphotoCamera(RunCamera):
    """The one camera that is plugged in."""

    released = False

    def __init__(self) -> None:
        """Connect to the camera, whose lens may not focus itself."""
        self._gp = _library()
        self._exposure_s: float | None = None
        try:
            self._connect()
        except CameraFault as error:
            raise InputError(f"--camera gphoto2: {error}") from None
        self.model = str(self._camera.get_abilities().model)
        self._names = [name for name in LOCKED if self._setting(name) is not None]
        self._check_focus()

    def _connect(self) -> None:
        self._camera = self._gp.Camera()
        try:
            self._camera.init()
        except self._gp.GPhoto2Error as error:
            raise CameraFault(
                f"no camera answers ({error}): switch it on, plug it in, and close what else uses "
                "it, for example gvfs-gphoto2-volume-monitor"
            ) from None
        if self._setting(AUTOFOCUS) not in (None, OFF):
            self._set(AUTOFOCUS, OFF)

    def _check_focus(self) -> None:
        for name in FOCUS:
            value = self._setting(name)
            if value is not None and MANUAL not in str(value).lower() and value != "MF":
                self.close()
                raise InputError(
                    f"--camera gphoto2: {name} is {value}: set the lens to manual focus, for the "
                    "focus must not change"
                )

    def expose(self, seconds: float) -> None:
        """Set the shutter to the nearest time that the camera has."""
        if seconds == self._exposure_s:
            return
        for name in SHUTTERS:
            times = self._shutter_times(name)
            if times:
                break
        else:
            raise CameraFault(f"its exposure cannot be set over USB: {MANUAL_EXPOSURE}")
        text = min(times, key=lambda one: abs(math.log(times[one] / seconds)))
        if not are_near(times[text], seconds):
            shortest, longest = min(times.values()), max(times.values())
            raise CameraFault(
                f"it has no exposure near {seconds:g} s: the nearest is {text}, all are from "
                f"{shortest:g} to {longest:g} s"
            )
        self._set(name, text)
        if (value := self._setting(name)) != text:
            raise CameraFault(f"{name} stays {value} when it is set to {text}: {MANUAL_EXPOSURE}")
        self._exposure_s = seconds

    def _shutter_times(self, name: str) -> dict[str, float]:
        """Choices of a shutter setting with their times, s; none if it cannot be set."""
        gp = self._gp
        try:
            widget = self._camera.get_single_config(name)
            if widget.get_readonly() or widget.get_type() not in (
                gp.GP_WIDGET_RADIO,
                gp.GP_WIDGET_MENU,
            ):
                return {}
            texts = [str(widget.get_choice(i)) for i in range(widget.count_choices())]
        except gp.GPhoto2Error:
            return {}
        return {text: time for text in texts if (time := shutter_seconds(text)) is not None}

    def photograph(self) -> Shot:
        """Release the camera, and read the photograph and its settings."""
        gp = self._gp
        try:
            path = self._camera.capture(gp.GP_CAPTURE_IMAGE)
            file = self._camera.file_get(path.folder, path.name, gp.GP_FILE_TYPE_NORMAL)
            data = bytes(file.get_data_and_size())
        except gp.GPhoto2Error as error:
            raise CameraFault(f"the camera gives no photograph: {error}") from None
        return Shot(data, suffix_of(path.name), self._settings())

    def _settings(self) -> dict[str, Setting]:
        found = {name: self._setting(name) for name in self._names}
        told = {name: value for name, value in found.items() if value is not None}
        return {"model": self.model, **told}

    def _setting(self, name: str) -> Setting | None:
        """A setting of the camera; None if it has none of this name."""
        try:
            value: Any = self._camera.get_single_config(name).get_value()
        except self._gp.GPhoto2Error:
            return None
        return value if isinstance(value, str | int | float) else None

    def _set(self, name: str, value: str) -> None:
        try:
            widget = self._camera.get_single_config(name)
            widget.set_value(value)
            self._camera.set_single_config(name, widget)
        except self._gp.GPhoto2Error as error:
            raise CameraFault(f"{name} cannot be set to {value}: {error}") from None

    def again(self) -> None:
        """Close the camera's session and open another."""
        self.close()
        self._connect()
        self._exposure_s = None
        if (model := str(self._camera.get_abilities().model)) != self.model:
            raise CameraFault(f"another camera answers, {model} and not {self.model}")

    def close(self) -> None:
        """Close the camera's session."""
        try:
            self._camera.exit()
        except self._gp.GPhoto2Error:
            return


def _library() -> ModuleType:
    try:
        import gphoto2
    except ImportError:
        raise InputError(f"--camera gphoto2: its library is not installed: {INSTALL}") from None
    return gphoto2  # type: ignore[no-any-return]
