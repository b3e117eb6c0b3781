"""Viewpoints around the object, and the quality of a light field's views from there."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene, depth_along_rays
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import GOLDEN_ANGLE, pinhole_picture
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.types import Bools, Bytes, Floats, Progress

# Blurs that are tried, standard deviations of a Gaussian in pixels, and how finely.
BLUR_RANGE_PX = (0.05, 20.0)
BLUR_STEP_PX = 0.01
SSIM_SIGMA, SSIM_RADIUS = 1.5, 5  # of SSIM's window, pixels
ELEVATIONS_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
# What is measured of a view: SSIM over the frame and where the object is; standard deviation of
# the Gaussian that blurs the truth as the view is blurred, at the object's centre; object's share.
QUALITY = ("psnr_db", "ssim", "ssim_on_object", "blur_mm", "object_share")


@dataclass(frozen=True)
class ImageQuality:
    """A picture against the truth.

    Both are NaN where the pictures show nothing but one and the same colour, black for instance.
    """

    psnr_db: float  # peak signal to noise ratio; infinite for equal pictures
    ssim: float  # structural similarity, 1 for equal pictures

    def words(self, other: str) -> str:
        """The figures in a line, against a picture of that name."""
        if math.isnan(self.ssim):
            return f"nothing to compare: it and the {other} picture are of one colour everywhere"
        return f"PSNR {self.psnr_db:.2f} dB, SSIM {self.ssim:.4f} against the {other} picture"


def image_quality(truth: Bytes, picture: Bytes) -> ImageQuality:
    """PSNR and SSIM of pictures (h, w, 3) over the whole frame, background included.

    SSIM as Z. Wang and others, IEEE Trans. Image Processing 13(4), 2004, section III: a Gaussian
    window of 1.5 pixels; the mean over the colours.
    """
    return image_quality_map(truth, picture)[0]


def image_quality_map(truth: Bytes, picture: Bytes) -> tuple[ImageQuality, Floats]:
    """The same, and SSIM about each pixel, the mean over the colours, (h, w)."""
    if (truth == truth[:1, :1]).all() and np.array_equal(truth, picture):
        return ImageQuality(math.nan, math.nan), np.full(truth.shape[:2], math.nan)
    error = np.mean((truth.astype(np.float64) - picture.astype(np.float64)) ** 2)
    psnr = float(10 * np.log10(255**2 / error)) if error > 0 else float("inf")
    about = _similarity(truth.astype(np.float64), picture.astype(np.float64))
    within = about[SSIM_RADIUS:-SSIM_RADIUS, SSIM_RADIUS:-SSIM_RADIUS]  # where the window fits
    ssim = float((within if within.size else about).mean())
    return ImageQuality(psnr, ssim), about.mean(axis=2)


def _similarity(x: Floats, y: Floats) -> Floats:
    """SSIM about each pixel and colour (h, w, 3): equation 13 of its authors."""
    from scipy.ndimage import gaussian_filter

    def window(values: Floats) -> Floats:
        sigma = (SSIM_SIGMA, SSIM_SIGMA, 0)
        return np.asarray(gaussian_filter(values, sigma, radius=(SSIM_RADIUS, SSIM_RADIUS, 0)))

    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    mx, my = window(x), window(y)
    vx, vy, vxy = window(x * x) - mx * mx, window(y * y) - my * my, window(x * y) - mx * my
    similar = (2 * mx * my + c1) * (2 * vxy + c2)
    return similar / ((mx * mx + my * my + c1) * (vx + vy + c2))


def equivalent_blur_px(truth: Bytes, picture: Bytes) -> float:
    """Blur of a picture (h, w, 3): standard deviation, in pixels, of a Gaussian.

    It is the Gaussian with which the blurred truth comes nearest to the picture, by least squares.
    """
    from scipy.ndimage import gaussian_filter
    from scipy.optimize import minimize_scalar

    sharp, target = truth.astype(np.float32), picture.astype(np.float32)

    def error(sigma: float) -> float:
        blurred = gaussian_filter(sharp, (sigma, sigma, 0))
        return float(np.mean((blurred - target) ** 2))

    fit = minimize_scalar(
        error, bounds=BLUR_RANGE_PX, method="bounded", options={"xatol": BLUR_STEP_PX}
    )
    return float(fit.x)


@dataclass(frozen=True)
class ViewMethod:
    """How the views of a light field are made."""

    name: str
    # of a light field: what makes the picture (h, w, 3) of a camera
    views: Callable[[LightField], Callable[[Camera], Bytes]]

    def __str__(self) -> str:
        return self.name


def _nearest(source: LightField) -> Callable[[Camera], Bytes]:
    tiles = MirrorTiles(source)
    return lambda view: synthesise(tiles, view).image


BY_NEAREST = ViewMethod("nearest", _nearest)


@dataclass(frozen=True)
class Viewpoints:
    """Viewpoints at some elevations, evenly around the object at each."""

    elevation_deg: Floats  # of each viewpoint, (v,)
    azimuth_deg: Floats  # of each viewpoint, (v,)
    distance_mm: float  # of all of them from the origin

    def angles(self) -> dict[str, Floats]:
        """Both as columns of a table."""
        return {"elevation_deg": self.elevation_deg, "azimuth_deg": self.azimuth_deg}

    def cameras(self, capture_mm: float, size: tuple[int, int] = (640, 480)) -> list[Camera]:
        """The cameras, of these columns and rows, each filled by the capture sphere."""
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg]).tolist()
        return [
            camera_around_object(a, e, self.distance_mm, capture_mm, size)
            for a, e in zip(azimuth, elevation, strict=True)
        ]


def viewpoints_around(
    elevations_deg: tuple[float, ...], azimuths: int, distance_mm: float
) -> Viewpoints:
    """Viewpoints at some elevations, and at each a number of azimuths evenly around the object."""
    around = np.arange(azimuths) * 360.0 / azimuths
    elevation, azimuth = (x.ravel() for x in np.meshgrid(elevations_deg, around, indexing="ij"))
    return Viewpoints(elevation, azimuth, distance_mm)


def viewpoints_over_hemisphere(count: int, distance_mm: float) -> Viewpoints:
    """Viewpoints evenly over the hemisphere, in no plane of symmetry (Vogel's spiral)."""
    step = np.arange(count) + 0.5
    elevation = np.degrees(np.arcsin(step / count))
    return Viewpoints(elevation, np.degrees(GOLDEN_ANGLE * step) % 360, distance_mm)


@dataclass(frozen=True)
class ViewTargets:
    """Pictures of a scene by real cameras."""

    scene: Scene
    cameras: list[Camera]
    truths: list[Bytes]  # from each, (h, w, 3)

    @cached_property
    def masks(self) -> list[Bools]:
        """Which pixels of each camera's picture show the object, (h, w)."""
        depth, masks = depth_along_rays(self.scene), []
        for view in self.cameras:
            direction = view_directions(view)
            origin = np.broadcast_to(view.pinhole, direction.shape)
            distance = depth(origin.reshape(-1, 3), direction.reshape(-1, 3))
            masks.append(np.isfinite(distance).reshape(direction.shape[:2]))
        return masks

    def quality(
        self, picture_of: Callable[[Camera], Bytes], progress: Progress
    ) -> dict[str, Floats]:
        """Pictures (h, w, 3) against the truth from each camera: QUALITY, each (v,)."""
        rows = []
        for k, view in enumerate(self.cameras):
            progress(f"view {k + 1} of {len(self.cameras)}")
            rows.append(_quality(view, self.truths[k], picture_of(view), self.masks[k]))
        return dict(zip(QUALITY, np.array(rows).T, strict=True))


def pinhole_targets(
    scene: Scene, cameras: list[Camera], progress: Progress = lambda _: None
) -> ViewTargets:
    """Pictures by pinhole cameras, ray-traced."""
    truths = []
    for k, view in enumerate(cameras):
        progress(f"truth {k + 1} of {len(cameras)}")
        truths.append(to_bytes(pinhole_picture(scene, view)))
    return ViewTargets(scene, cameras, truths)


def _quality(view: Camera, truth: Bytes, picture: Bytes, mask: Bools) -> tuple[float, ...]:
    """QUALITY of one view; `mask` (h, w): where the truth shows the object."""
    quality, about = image_quality_map(truth, picture)
    blur_mm = equivalent_blur_px(truth, picture) * view.pixel_pitch * float(norm(view.pinhole))
    on_object = float(about[mask].mean()) if mask.any() else np.nan
    return quality.psnr_db, quality.ssim, on_object, blur_mm, float(mask.mean())
