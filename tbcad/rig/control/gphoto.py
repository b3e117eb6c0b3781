"""A camera on USB, by libgphoto2: released and read by its own protocol.

Sources: python-gphoto2 2.6 (examples/capture-image.py, camera-config-values.py); libgphoto2
camlibs/ptp2/config.c for the names of the settings.
"""

import math
from types import ModuleType
from typing import Any

from tbcad.errors import InputError
from tbcad.records.run import Setting
from tbcad.rig.control.camera import RunCamera, Shot, are_near, shutter_seconds, suffix_of
from tbcad.rig.control.messages import INSTALL
from tbcad.rig.control.plan import CameraFault

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
