"""A lens with a pupil before pixels: points of its pupil, and how pixels and diffraction blur.

A point is spread by rays through the pupil and by the Airy pattern of the whole pupil, as if both
were independent. In focus that is exact. Out of focus it takes too much contrast from fine lines,
since rays from the rim are counted where waves from it no longer overlap: so rays go through
`RAY_SHARE` of the pupil (docs/decisions/0053-real-optics.md; `defocused_mtf` is exact).
"""

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_sum
from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import LensCamera, distorted, undistorted
from tbcad.types import Floats

Signal = NDArray[np.float32]

WAVELENGTH_MM = 550e-6
FINE = 2  # rays of a pixel along its sides, each through a point of the pupil of its own
RAY_SHARE = 0.75  # of the pupil's diameter that rays go through
KERNEL_PX = 3  # reach of the kernel, pixels
FREQUENCIES = 256  # of the sum that gives the kernel, along each side
RANK = 2  # of the kernel as a sum of products: what is left out is 0.2 % of it


@dataclass(frozen=True)
class PupilLens:
    """A thin lens without aberrations, as far as what is before it can tell."""

    pupil_mm: float  # diameter of the entrance pupil
    focus_mm: float  # depth that is sharp, along the axis

    def cutoff(self, pitch: float) -> float:
        """Finest lines that diffraction lets through, cycles a pixel; `pitch`: at unit distance."""
        return self.pupil_mm / WAVELENGTH_MM * pitch

    def blur_px(self, depth: Floats, pitch: float) -> Floats:
        """Diameter of the blur circle of points at depths (...), mm, in pixels."""
        return self.pupil_mm * np.abs(1 / depth - 1 / self.focus_mm) / pitch


@dataclass(frozen=True)
class PupilCamera(LensCamera):
    """A camera that sees through one point of its pupil, which is its `pinhole`."""

    aside: Floats = field(default_factory=lambda: np.zeros(2))
    """The point beside the pupil's middle, along rows and columns, over the depth in focus."""

    def project(self, points: Floats) -> Floats:
        """As of `LensCamera`: the pixel is that of where the ray meets the plane in focus."""
        image = (points - self.pinhole) @ self.axes.T
        place = distorted(image[..., :2] / image[..., 2:] + self.aside, self.distortion)
        return np.asarray(place * self.focal + self.principal)

    def directions(self, pixels: Floats) -> Floats:
        """As of `LensCamera`, from the point to what the pixel shows in focus."""
        place = undistorted((pixels - self.principal) / self.focal, self.distortion) - self.aside
        return unit(np.append(place, np.ones((*place.shape[:-1], 1)), axis=-1) @ self.axes)


def through_pupil(camera: LensCamera, point: Floats, focus: float) -> PupilCamera:
    """A camera through a point (3,) beside its pinhole, in focus at a depth, mm."""
    kept = {one.name: getattr(camera, one.name) for one in fields(LensCamera)}
    kept["pinhole"] = camera.pinhole + point
    return PupilCamera(**kept, aside=camera.axes[:2] @ point / focus)


def pupil_points(fine: int = FINE) -> Floats:
    """Points (fine, fine, 2) of a pupil of radius 1, by place in the pixel, each of equal share.

    Their mean square along each axis is that of a disc, 1/4, so that blurs have the right width.
    """
    places = (np.arange(fine) + 0.5) / fine - 0.5
    y, x = np.meshgrid(places, places, indexing="ij")
    points = np.stack([y, -x], axis=-1)  # a quarter turn: place and pupil do not vary together
    return np.asarray(points / (2 * points.std(axis=(0, 1))))


def diffraction_mtf(share: Floats) -> Floats:
    """Contrast (...) that a round pupil leaves of lines, by share of the finest, `cutoff`.

    Source: J. W. Goodman, Introduction to Fourier Optics, section 6.3.
    """
    v = np.clip(np.abs(share), 0, 1)
    return np.asarray(2 / np.pi * (np.arccos(v) - v * np.sqrt(1 - v**2)))


def pixel_kernel(
    cutoff: float, fine: int = FINE, reach: int = KERNEL_PX, filter_px: float = 0.0
) -> Floats:
    """Shares (2 k, 2 k) of fine samples in a pixel behind its aperture and a pupil.

    The pixel is all sensitive; `cutoff`: cycles a pixel. k = fine (reach + 1/2) samples lie on each
    side of its middle. What they lack of 1 is light of the Airy pattern farther away. `filter_px`:
    separation of the four images of an optical low-pass filter.
    """
    half = reach * fine + fine / 2
    at = (np.arange(2 * half) + 0.5 - half) / fine
    step = fine / FREQUENCIES
    f = (np.arange(FREQUENCIES) + 0.5) * step - fine / 2
    fx, fy = np.meshgrid(f, f)
    contrast = np.sinc(fx) * np.sinc(fy) * diffraction_mtf(np.hypot(fx, fy) / cutoff)
    contrast *= np.cos(np.pi * filter_px * fx) * np.cos(np.pi * filter_px * fy)
    wave = np.cos(2 * np.pi * at[:, None] * f)
    return np.asarray(wave @ contrast @ wave.T * (step / fine) ** 2)


def kernel_factors(kernel: Floats) -> Floats:
    """Profiles (r, 2 k) the sum of whose products, each with itself and its sign, is the kernel.

    The last column of each row is that sign: (r, 2 k + 1).
    """
    weight, profile = np.linalg.eigh(kernel)
    chosen = np.argsort(-np.abs(weight))[:RANK]
    scaled = profile[:, chosen] * np.sqrt(np.abs(weight[chosen]))
    return np.column_stack([scaled.T, np.sign(weight[chosen])])


@compiled_sum
def pixels_of_samples(samples: Signal, factors: Floats, fine: int) -> Signal:
    """Pixels (h, w, c) of fine samples (fine h + 2 k - fine, fine w + 2 k - fine, c) by a kernel.

    `factors`: of `kernel_factors`.
    """
    size = factors.shape[1] - 1
    rows, columns = samples.shape[0] - size + fine, samples.shape[1] - size + fine
    height, width, colours = rows // fine, columns // fine, samples.shape[2]
    result = np.zeros((height, width, colours), dtype=np.float32)
    flat = samples.reshape(samples.shape[0], -1)
    line = np.empty(flat.shape[1], dtype=np.float32)
    for factor in factors:
        for y in range(height):
            line[:] = 0
            for j in range(size):
                weight = np.float32(factor[j])
                for k in range(len(line)):
                    line[k] += weight * flat[fine * y + j, k]
            for x in range(width):
                for i in range(size):
                    weight = np.float32(factor[i] * factor[size])
                    for c in range(colours):
                        result[y, x, c] += weight * line[(fine * x + i) * colours + c]
    return result


def defocused_mtf(share: Floats, waves: float, points: int = 400) -> Floats:
    """Contrast (k,) behind a round pupil with a defocus of so many wavelengths at its rim.

    The overlap of the pupil with itself, shifted by each share (k,) of `cutoff`, with the phase
    between both (H. H. Hopkins, Proc. R. Soc. A 231, 1955), summed over points x points.
    """
    x, y = np.meshgrid(*[(np.arange(points) + 0.5) / points * 2 - 1] * 2)
    result = []
    for shift in np.abs(share).tolist():
        both = (np.hypot(x - shift, y) < 1) & (np.hypot(x + shift, y) < 1)
        phase = 2 * np.pi * waves * ((x + shift) ** 2 - (x - shift) ** 2)
        result.append(np.cos(phase[both]).sum())
    return np.asarray(np.array(result) / (np.hypot(x, y) < 1).sum())
