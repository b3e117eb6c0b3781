"""Resolvable spots of virtual cameras before a real lens, and the pupil with the most of them.

The area of a point's spread is 1 / sum(MTF^2) over all lines (the equivalent passband of O. H.
Schade, RCA Review 9, 1948): an even spot has its own, a pixel alone one pixel. So spots count as
pixels do, and are pixels behind a pinhole without diffraction.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import minimize_scalar
from scipy.special import j1

from tbcad.core.camera.requirements import DepthRange, VirtualImages
from tbcad.core.optics.lens import RAY_SHARE, PupilLens, diffraction_mtf
from tbcad.types import Floats

FREQUENCIES = 48  # of the sum over lines, along each axis
BLURS = 20  # blur circles along each axis, between which a passband is linear
PUPILS_MM = (0.05, 5.0)  # among which the best is looked for
PUPIL_TOLERANCE = 0.01  # relative
ROUNDING = 1e-9  # by which the table of blurs goes beyond the largest


def passbands(blur_px: Floats, cutoff: float) -> Floats:
    """Spots of a pixel (b, b) with blur circles (b,) along one axis and the other, pixels.

    `cutoff`: finest lines that diffraction lets through, cycles a pixel. Rays go through
    `RAY_SHARE` of the pupil (tbcad.core.optics.lens).
    """
    node, weight = np.polynomial.legendre.leggauss(FREQUENCIES)
    f, weight = cutoff * (node + 1) / 2, cutoff * weight
    pixel = np.sinc(f) ** 2 * weight
    even = diffraction_mtf(np.hypot(f[:, None], f) / cutoff) ** 2 * pixel[:, None] * pixel
    across = RAY_SHARE * np.pi * np.asarray(blur_px)[:, None] * f
    phase = np.hypot(across[:, None, :, None], across[None, :, None, :])
    disc = np.where(phase > 0, 2 * j1(phase) / np.where(phase > 0, phase, 1), 1)
    return np.asarray(np.einsum("abxy,xy->ab", disc**2, even))


@dataclass(frozen=True)
class ResolvedSpots:
    """The m mirrors of a camera with their pixels."""

    images: VirtualImages
    pixels: Floats  # of each that see the capture sphere, (m,)
    pitch: float  # width of a pixel at unit distance

    @cached_property
    def focus(self) -> float:
        """Depth with the same blur at both ends, as camera.json has it, mm."""
        depth = self.images.depth
        return DepthRange(float(depth.min()), float(depth.max())).focus

    def share(self, pupil_mm: float) -> Floats:
        """Spots of a pixel (m,), as the mean of the sphere's near end, centre and far end."""
        lens = PupilLens(pupil_mm, self.focus)
        blur = lens.blur_px(self.images.depth, self.pitch)
        grid = blur.max() * (1 + ROUNDING) * np.linspace(0, 1, BLURS) ** 2
        table = passbands(grid, lens.cutoff(self.pitch))
        return np.asarray(RegularGridInterpolator((grid, grid), table)(blur).mean(axis=1))

    @cached_property
    def best_pupil(self) -> float:
        """Diameter with the most spots in the geometric mean over mirrors, mm.

        With the most of all together few mirrors would be sharp, and the others paid for it.
        """
        found = minimize_scalar(
            lambda log: -np.log(self.share(float(np.exp(log)))).mean(),
            bounds=tuple(np.log(PUPILS_MM)),
            method="bounded",
            options={"xatol": PUPIL_TOLERANCE},
        )
        return float(np.exp(found.x))

    @cached_property
    def spots(self) -> Floats:
        """Spots of each mirror with that pupil, (m,)."""
        return np.asarray(self.pixels * self.share(self.best_pupil))


def spot_mm(capture_mm: float, spots: float) -> float:
    """Width of a square at the object, if so many fill the disc that is seen of the sphere, mm."""
    return float(capture_mm * np.sqrt(np.pi / 4 / spots))
