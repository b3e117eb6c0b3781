"""How like two pictures are."""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.types import Bytes, Floats

# Blurs that are tried, standard deviations of a Gaussian in pixels, and how finely.
BLUR_RANGE_PX = (0.05, 20.0)
BLUR_STEP_PX = 0.01
SSIM_SIGMA, SSIM_RADIUS = 1.5, 5  # of SSIM's window, pixels


@dataclass(frozen=True)
class ImageQuality:
    """A picture against the truth.

    Attributes:
        psnr_db: peak signal to noise ratio; infinite for equal pictures.
        ssim: structural similarity, 1 for equal pictures.

    Both are NaN where the pictures show nothing but one and the same colour, black for instance.
    """

    psnr_db: float
    ssim: float

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
