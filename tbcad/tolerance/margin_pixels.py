"""What margins cost: pixels of the virtual cameras whose light comes from the capture sphere."""

from dataclasses import dataclass

import numpy as np

from tbcad.mirrors.array import MirrorArray, design
from tbcad.simulate.capture.pixel_counts import Sensor, count_pixels
from tbcad.spec.design import Spec
from tbcad.types import Floats


@dataclass(frozen=True)
class SeeingPixels:
    """Pixels of a virtual camera that see the capture sphere.

    Attributes:
        median: of all virtual cameras.
        minimum: of all virtual cameras.
    """

    median: float
    minimum: float

    def __str__(self) -> str:
        """Both, as text."""
        return f"{self.median:.0f} (minimum {self.minimum:.0f})"


def seeing_pixels(spec: Spec) -> SeeingPixels:
    """Count the pixels of a design by one ray through each.

    Raises:
        SpecError: the design cannot be made.
    """
    radius = spec.optics.capture_diameter_mm / 2
    pixels = pixels_of_cameras(design(spec).arrays[0], radius)
    return SeeingPixels(float(np.median(pixels)), float(pixels.min()))


def pixels_of_cameras(array: MirrorArray, radius: float) -> Floats:
    """Pixels that see the capture sphere, over the v virtual cameras of both halves, (v,).

    Both halves of a mirror on the seam count together.

    Args:
        array: camera a's mirrors.
        radius: of the capture sphere, mm.
    """
    camera = array.camera
    sensor = Sensor(camera.width_px, camera.height_px)
    seen = count_pixels(array, (sensor,), radius)[0].seen
    halved = array.u[:, 0] == 0
    return np.concatenate([np.where(halved, 2 * seen, seen), seen[~halved]])
