"""Viewpoints of synthesised pictures: pinhole cameras that look at the middle of the object."""

import numpy as np

from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.simulate.scene.rays import unit_directions
from tbcad.types import Floats

# Size of a picture in diameters of the capture sphere.
FRAME_MARGIN = 1.05


def camera_around_object(
    azimuth: float,
    elevation: float,
    distance: float,
    capture_mm: float,
    size: tuple[int, int] = (640, 480),
    hfov: float | None = None,
) -> Camera:
    """A pinhole camera that looks at the origin, z up.

    Args:
        azimuth: about z from x, radians.
        elevation: above the plane z = 0, radians.
        distance: from the origin, mm.
        capture_mm: diameter of the capture sphere.
        size: columns and rows.
        hfov: angle of view across the columns, radians; without, the capture sphere fills the
            shorter side but for a small margin.

    Raises:
        InputError: the viewpoint lies below the hemisphere of virtual cameras, or in the object.
    """
    if not 0 <= elevation <= np.pi / 2:
        raise InputError(
            f"--elevation {np.degrees(elevation):g} is not on the hemisphere that the mirrors "
            "see: allowed is 0 to 90 degrees"
        )
    if not capture_mm / 2 < distance < np.inf:
        raise InputError(
            f"--distance {distance:g} is inside the object's capture sphere: allowed is more than "
            f"{capture_mm / 2:g} mm"
        )
    if not np.isfinite(azimuth):
        raise InputError("--azimuth is not a number: give degrees")
    horizontal = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    forward = -np.cos(elevation) * horizontal - np.sin(elevation) * np.array([0.0, 0.0, 1.0])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    if hfov is None:
        tangent = np.tan(np.arcsin(capture_mm / 2 / distance))
        hfov = float(2 * np.arctan(FRAME_MARGIN * tangent * size[0] / min(size)))
    return Camera(-distance * forward, forward, right, *size, hfov)


def view_directions(view: Camera, shift: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """Unit directions (h, w, 3) of all pixels."""
    return unit_directions(view, range(view.height_px), shift)
