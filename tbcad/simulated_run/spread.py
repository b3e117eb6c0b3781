"""How a point's light spreads: the low-pass filter, the lens and the area of a pixel."""

from dataclasses import dataclass
from math import erf, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from tbcad.compiled import compiled
from tbcad.types import Floats

REACH = 4.0  # standard deviations beyond which a point gives no light


@dataclass(frozen=True)
class PointSpread:
    """Spread of a point's light, the same along rows and columns.

    Attributes:
        separation_px: of the low-pass filter's images, see
            tbcad.simulate.capture.pixel_response.
        lens_px: standard deviation of the lens's spread.
    """

    separation_px: float = 1.0
    lens_px: float = 0.4

    @property
    def half_px(self) -> int:
        """Pixels that a point's light reaches on each side."""
        return int(np.ceil(REACH * self.lens_px + self.separation_px / 2 + 0.5))


def add_points(image: NDArray[np.float32], pixel: Floats, light: Floats, psf: PointSpread) -> None:
    """Add the light (n,) of points at columns and rows (n, 2) to an image (h, w).

    A pixel takes what falls on its area: the integral of the spread over it.
    """
    _add_points(image, pixel, light, psf.separation_px, psf.lens_px, psf.half_px)


def blurred(picture: NDArray[np.float32], psf: PointSpread) -> NDArray[np.float32]:
    """A picture (h, w, c), of one ray a pixel, behind filter and lens."""
    half = psf.half_px
    line = np.zeros((1, 2 * half + 1), dtype=np.float32)
    centre = np.array([[half, 0.0]])
    # The middle row of a point's image is its spread along the row; its sum is made one.
    _add_points(line, centre, np.ones(1), psf.separation_px, psf.lens_px, half)
    kernel = (line[0] / line.sum()).astype(np.float32)
    across = convolve1d(picture, kernel, axis=1, mode="constant")
    return np.asarray(convolve1d(across, kernel, axis=0, mode="constant"))


@compiled
def _add_points(
    image: NDArray[np.float32],
    pixel: Floats,
    light: Floats,
    separation: float,
    lens: float,
    half: int,
) -> None:
    height, width = image.shape
    size = 2 * half + 2
    share = np.empty((2, size))
    for i in range(len(pixel)):
        first = np.empty(2, dtype=np.int64)
        for axis in range(2):
            first[axis] = int(np.floor(pixel[i, axis])) - half
            for k in range(size):
                share[axis, k] = 0.0
                for side in (-0.5, 0.5):
                    place = pixel[i, axis] + side * separation
                    near = (first[axis] + k - 0.5 - place) / lens
                    far = (first[axis] + k + 0.5 - place) / lens
                    share[axis, k] += 0.25 * (erf(far / sqrt(2.0)) - erf(near / sqrt(2.0)))
        for b in range(size):
            y = first[1] + b
            if 0 <= y < height:
                for a in range(size):
                    x = first[0] + a
                    if 0 <= x < width:
                        image[y, x] += light[i] * share[0, a] * share[1, b]
