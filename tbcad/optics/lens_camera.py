"""A real camera: a pinhole, square or oblong pixels, and the distortion of its lens."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import unit
from tbcad.optics.camera import Camera
from tbcad.types import Bools, Floats

# Of the search for undistorted places; each gains about two digits where distortion is small.
ITERATIONS = 30
ROOT_ROUNDING = 1e-9  # imaginary part of a real root of a polynomial


@dataclass(frozen=True)
class LensCamera:
    """Camera whose lens distorts as OpenCV's model says (calib3d, "Detailed Description").

    Attributes:
        pinhole: mm, (3,).
        axes: rows: unit vectors along the rows, down the columns, and forward, (3, 3).
        focal: focal lengths along rows and columns, pixels, (2,).
        principal: column and row of the optical axis; whole numbers are pixel centres, (2,).
        distortion: k1, k2, p1, p2, k3, (5,).
        width_px: columns.
        height_px: rows.
    """

    pinhole: Floats
    axes: Floats
    focal: Floats
    principal: Floats
    distortion: Floats
    width_px: int
    height_px: int

    def project(self, points: Floats) -> Floats:
        """Column and row (..., 2) where points (..., 3) appear."""
        image = (points - self.pinhole) @ self.axes.T
        place = distorted(image[..., :2] / image[..., 2:], self.distortion)
        return np.asarray(place * self.focal + self.principal)

    def directions(self, pixels: Floats) -> Floats:
        """Unit directions (..., 3) through columns and rows (..., 2)."""
        place = undistorted((pixels - self.principal) / self.focal, self.distortion)
        ahead = np.ones((*place.shape[:-1], 1))
        return unit(np.concatenate([place, ahead], axis=-1) @ self.axes)

    def shows(self, direction: Floats) -> Bools:
        """Whether directions (..., 3) are ahead, where the lens's model still holds, (...).

        Beyond, where its radial part turns back, it would show what is outside of the picture.
        """
        x, y, ahead = np.moveaxis(direction @ self.axes.T, -1, 0)
        return np.asarray((ahead > 0) & (np.hypot(x, y) < self.reach * ahead))

    @property
    def reach(self) -> float:
        """Distance from the axis, at unit distance, up to which the lens spreads what it shows."""
        k1, k2, _, _, k3 = self.distortion
        roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1])
        square = roots[(np.abs(roots.imag) < ROOT_ROUNDING) & (roots.real > 0)].real
        return float(np.sqrt(square.min(initial=np.inf)))


def vignetting(camera: LensCamera, directions: Floats) -> Floats:
    """Share of the light (...) that a lens lets through along unit directions (..., 3).

    The fourth power of the cosine of the angle to the optical axis, as of a thin lens.
    """
    return np.asarray((directions @ camera.axes[2]) ** 4)


def vignetting_slope(camera: LensCamera, pixels: Floats) -> Floats:
    """Share by which the light grows for a pixel along rows and columns, at places (..., 2).

    Of a lens that does not distort: one that does changes it by a few percent.
    """
    place = (pixels - camera.principal) / camera.focal
    square = (place**2).sum(axis=-1, keepdims=True)
    return np.asarray(-4 * place / (1 + square) / camera.focal)


def without_distortion(camera: Camera) -> LensCamera:
    """The designed camera, whose lens does not distort."""
    size = np.array([camera.width_px, camera.height_px])
    return LensCamera(
        pinhole=camera.pinhole,
        axes=camera.axes,
        focal=np.full(2, 1 / camera.pixel_pitch),
        principal=(size - 1) / 2,
        distortion=np.zeros(5),
        width_px=camera.width_px,
        height_px=camera.height_px,
    )


def distorted(place: Floats, coefficients: Floats) -> Floats:
    """Where a lens shows places (..., 2) at unit distance, given k1, k2, p1, p2, k3."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = place[..., 0], place[..., 1]
    square = x * x + y * y
    radial = 1 + square * (k1 + square * (k2 + square * k3))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
            y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )


def undistorted(place: Floats, coefficients: Floats) -> Floats:
    """The inverse of `distorted`, by repeated substitution."""
    found = place
    if coefficients.any():
        for _ in range(ITERATIONS):
            found = found + place - distorted(found, coefficients)
    return found
