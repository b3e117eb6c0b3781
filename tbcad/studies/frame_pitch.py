"""How many apices are in the frame, wherever the camera looks: the paper does not say where."""

from functools import cache

import numpy as np

from tbcad.geometry.ellipsoid import Ellipsoid
from tbcad.mirrors.array import numbered_directions
from tbcad.spec.design import Spec
from tbcad.studies.paper import balanced_sensors, with_lens_of_table_i
from tbcad.types import Floats

# Pitches that are tried, degrees from the vertical; the object is toward positive ones.
PITCHES_DEG = np.arange(-30.0, 60.0, 0.02)


def apices_in_frame(spec: Spec, n: int, pitch: float) -> int:
    """Apices of both arrays in their cameras' frames; those on the seam count for both.

    Args:
        spec: optics and lens; sensor of its shape.
        n: subdivision.
        pitch: from the vertical toward the object, radians; rows of pixels lie along y.
    """
    camera = with_lens_of_table_i(spec).camera
    half_width = np.tan(np.radians(camera.hfov_deg) / 2)
    half_height = half_width * camera.height_px / camera.width_px
    optics = spec.optics
    ray = _rays_to_apices(n, optics.camera_mm, optics.semi_minor_mm, optics.stretch)
    forward, right = axes_at_pitch(pitch)
    depth, along, across = np.stack([forward, right, np.cross(forward, right)]) @ ray.T
    inside = (np.abs(along) <= half_width * depth) & (np.abs(across) <= half_height * depth)
    return 2 * int(inside.sum())


def axes_at_pitch(pitch: float) -> tuple[Floats, Floats]:
    """Forward and right of camera a at a pitch (radians) from the vertical, (3,) each."""
    forward = np.array([-np.sin(pitch), 0.0, np.cos(pitch)])
    return forward, np.array([0.0, 1.0, 0.0])


def best_pitch(spec: Spec) -> float:
    """The pitch whose counts come nearest to the second column of Table II, radians.

    Nearest: the sum of the absolute differences is smallest; the middle of the pitches with that.
    """
    pitches = np.radians(PITCHES_DEG)
    off = np.zeros(len(pitches))
    for row in balanced_sensors():
        counts = [apices_in_frame(spec, row.n, pitch) for pitch in pitches.tolist()]
        off += np.abs(np.array(counts) - row.average_of_virtual_camera_resolution)
    return float(np.median(pitches[off == off.min()]))


@cache
def _rays_to_apices(
    n: int, pinhole: tuple[float, ...], semi_minor: float, stretch: tuple[float, float]
) -> Floats:
    """From camera a's pinhole to its mirrors' apices, mm, (m, 3)."""
    ellipsoid = Ellipsoid(np.array(pinhole), semi_minor)
    u = numbered_directions(n, stretch)[0]
    half_a = (u[:, 0] >= 0) & (u[:, 2] >= 0)
    return ellipsoid.apices(u[half_a]) - ellipsoid.pinhole
