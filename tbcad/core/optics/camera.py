"""Cameras: a pinhole whose orientation brings all its mirrors into the frame, and a real lens."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from tbcad.core.geometry.vectors import FLIP_X, unit
from tbcad.types import Bools, Floats

MAX_FILL = 1e3  # a tilt with points behind the camera has an infinite fill, of no use to a search
TILT_DIGITS = 8  # digits beyond are noise of the search: a symmetric array gets a symmetric camera
RIGHT_ANGLE = np.pi / 2
# A fitting frame is filled to this share of its width and height: 2 % of them stay free on each
# side for the errors of a lens and of its mounting.
FITTED_FILL = 0.96
ITERATIONS = 30  # for undistorted places; each gains about two digits where distortion is small
ROOT_ROUNDING = 1e-9  # imaginary part of a real root of a polynomial


@dataclass(frozen=True)
class Camera:
    """Pinhole camera with square pixels."""

    pinhole: Floats  # mm, (3,)
    forward: Floats  # unit vector along the optical axis, (3,)
    right: Floats  # unit vector along the rows, (3,); down the columns is forward x right
    width_px: int  # columns
    height_px: int  # rows
    hfov: float  # angle of view across the columns, radians

    @property
    def half_sizes(self) -> Floats:
        """Half width and half height of the image at unit distance, (2,)."""
        half = np.tan(self.hfov / 2)
        return np.array([half, half * self.height_px / self.width_px])

    @property
    def axes(self) -> Floats:
        """Rows: unit vectors along the rows, down the columns, and forward, (3, 3)."""
        return np.stack([self.right, np.cross(self.forward, self.right), self.forward])

    @property
    def pixel_pitch(self) -> float:
        """Width of a pixel at unit distance."""
        return float(2 * self.half_sizes[0] / self.width_px)

    def project(self, points: Floats) -> Floats:
        """Column and row (..., 2) where points (..., 3) appear; whole numbers are pixel centres."""
        image = (points - self.pinhole) @ self.axes.T
        size = np.array([self.width_px, self.height_px])
        return np.asarray(image[..., :2] / image[..., 2:] / self.pixel_pitch + (size - 1) / 2)

    def fill(self, points: Floats) -> float:
        """Share of the frame that points (k, 3) fill, 1 on its edge; infinite behind the camera."""
        return _fill(self.forward, self.right, self.half_sizes, points - self.pinhole)

    def coarser(self, times: int) -> "Camera":
        """The same camera, each of its pixels as wide and high as so many."""
        return replace(self, width_px=self.width_px // times, height_px=self.height_px // times)

    def mirrored(self) -> "Camera":
        """Camera b for camera a: the mirror image in the plane x = 0, with its rows reversed."""
        pinhole, forward, right = (
            one * FLIP_X for one in (self.pinhole, self.forward, -self.right)
        )
        return replace(self, pinhole=pinhole, forward=forward, right=right)


def _fill(forward: Floats, right: Floats, half_sizes: Floats, rays: Floats) -> float:
    depth = rays @ forward
    if depth.min() <= 0:
        return np.inf
    across = rays @ np.column_stack([right, np.cross(forward, right)])
    return float(np.max(np.abs(across) / depth[:, None] / half_sizes))


def fitted_camera(
    pinhole: Floats, points: Floats, width_px: int, height_px: int, hfov: float
) -> Camera:
    """The camera whose orientation leaves the widest margin round points (k, 3), mm, in its frame.

    The rows lie across the plane of the ellipsoid's axis and z, along which the array is widest.
    The angle of view hfov (radians) is across the columns.
    """
    rays = unit(points - pinhole)
    middle = unit(rays.mean(axis=0))
    across = unit(np.cross([0.0, 0.0, 1.0], -pinhole))
    along = np.cross(middle, across)
    half = np.tan(hfov / 2)
    half_sizes = np.array([half, half * height_px / width_px])

    def axes(tilt: Floats) -> tuple[Floats, Floats]:
        forward = unit(middle + tilt[0] * across + tilt[1] * along)
        return forward, unit(across - (across @ forward) * forward)

    def fill(tilt: Floats) -> float:
        return min(_fill(*axes(tilt), half_sizes, rays), MAX_FILL)

    optimum = minimize(
        fill,
        np.zeros(2),
        method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-9, "maxiter": 2000},
    )
    forward, right = axes(np.round(optimum.x, TILT_DIGITS) + 0.0)
    return Camera(pinhole, forward, right, width_px, height_px, hfov)


def fitting_view_angle_deg(pinhole: Floats, points: Floats, width_px: int, height_px: int) -> float:
    """The smallest view angle in whole degrees whose frame holds points (k, 3) with a border.

    Arguments as of `fitted_camera`. 180 degrees when no frame holds them.
    """
    camera = fitted_camera(pinhole, points, width_px, height_px, RIGHT_ANGLE)
    half_width = camera.half_sizes[0] * camera.fill(points) / FITTED_FILL
    return float(np.ceil(np.degrees(2 * np.arctan(half_width))))


@dataclass(frozen=True)
class LensCamera:
    """Camera whose lens distorts as OpenCV's model says (calib3d, "Detailed Description")."""

    pinhole: Floats  # mm, (3,)
    axes: Floats  # rows: unit vectors along the rows, down the columns, and forward, (3, 3)
    focal: Floats  # focal lengths along rows and columns, pixels, (2,)
    principal: Floats  # column and row of the optical axis; whole numbers are pixel centres, (2,)
    distortion: Floats  # k1, k2, p1, p2, k3, (5,)
    width_px: int  # columns
    height_px: int  # rows

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
