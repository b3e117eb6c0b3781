"""Keys that follow from a design's camera, tried with all bodies of the arrangement."""

from dataclasses import dataclass
from typing import Any

from tbcad.core.camera.sheet import ISO, RigLight
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.section import AUTO
from tbcad.prototype.arrangement import PrototypeModel, arrange
from tbcad.prototype.frame.camera_mount import CameraMount
from tbcad.prototype.frame.chosen_camera import NONE
from tbcad.prototype.light.lamp import LampLayout

DIGITS = 3


@dataclass(frozen=True)
class CameraFit:
    """Light and mount of a prototype, and what the camera sets in it."""

    light: RigLight
    sets: dict[str, Any]  # lengths in mm, seconds; empty: no camera of the lists
    lines: tuple[str, ...]  # the same for people


def fit_camera(design: MirrorDesign) -> CameraFit:
    """Keys set by the design's camera; none where a design without a named one has no prototype.

    SpecError: the named camera does not fit; it names one that does.
    """
    named = design.spec.prototype.frame.camera not in (AUTO, NONE)
    try:
        return _fit(arrange(design))
    except SpecError as error:
        if not named:
            return CameraFit(RigLight(), {}, ("no prototype can be laid out",))
        other = _other(design)
        if not other or other in str(error):
            raise
        raise SpecError(f"{error}; {other} fits") from None


def _other(design: MirrorDesign) -> str | None:
    """The camera that the prototype has where it may choose."""
    prototype = design.spec.prototype
    frame = prototype.frame.model_copy(update={"camera": AUTO})
    free = spec_with(design.spec, prototype={"frame": frame})
    try:
        return arrange(MirrorDesign(free, design.arrays)).rig_light.mounted
    except SpecError:
        return None


def _fit(model: PrototypeModel) -> CameraFit:
    light, mount = model.rig_light, model.frame.find(CameraMount)
    if mount is None or mount.chosen is None:
        return CameraFit(light, {}, ("the mount is for no camera of the lists",))
    frame, lamps, best = model.spec.prototype.frame, model.frame.find(LampLayout), mount.chosen.best
    sets = {
        "camera_axis_mm": frame.camera_axis_mm,
        "camera_screw_mm": frame.camera_screw_mm,
        "camera_back_mm": frame.camera_back_mm,
        "riser_mm": mount.riser,
        "lens_front_mm": mount.chosen.front,
        "stands_apart_mm": 2 * lamps.column if lamps else None,
        "exposure_s": light.exposure(best),
        "trigger": best.camera.trigger,
    }
    rounded = {
        key: round(value, DIGITS) if isinstance(value, float) else value
        for key, value in sets.items()
    }
    at = f" at {light.lux:.0f} lx, ISO {ISO:g}" if light.lux else " (no lamps)"
    waits = model.spec.prototype.motion.exposure_s
    nearest = min(model.frame.swept[body.name] for body in mount.purchased)
    return CameraFit(
        light,
        rounded,
        (
            f"{light.mounted} fits",
            f"axis      {frame.camera_axis_mm:g} mm over what the camera stands on, "
            + (f"a riser of {mount.riser:g} mm" if mount.riser else "no riser"),
            f"thread    {frame.camera_screw_mm:g} mm behind the pinhole, fence at the back at "
            f"{frame.camera_back_mm:g} mm",
            f"lens      from {-mount.chosen.front:.1f} mm before the pinhole; nothing that turns "
            f"comes nearer than {nearest:.0f} mm",
            f"lamps     columns {sets['stands_apart_mm']:g} mm apart"
            if lamps
            else "lamps     none",
            f"exposure  {light.exposure(best):.2g} s{at}; the program waits {waits:g} s "
            "(prototype.motion.exposure_s)",
            f"trigger   {best.camera.trigger or 'not known'}",
            f'design    prototype.frame.camera = "{light.mounted}"',
        ),
    )
