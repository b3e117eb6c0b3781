"""How like two pictures are."""

from dataclasses import dataclass

import numpy as np

from tbcad.types import Bytes


@dataclass(frozen=True)
class ImageQuality:
    """A picture against the truth.

    Attributes:
        psnr_db: peak signal to noise ratio; infinite for equal pictures.
        ssim: structural similarity, 1 for equal pictures.
    """

    psnr_db: float
    ssim: float


def image_quality(truth: Bytes, picture: Bytes) -> ImageQuality:
    """PSNR and SSIM of pictures (h, w, 3) over the whole frame, background included.

    SSIM as Z. Wang and others, IEEE Trans. Image Processing 13(4), 2004, section III: a Gaussian
    window of 1.5 pixels; the mean over the colours.
    """
    from skimage.metrics import structural_similarity

    error = np.mean((truth.astype(np.float64) - picture.astype(np.float64)) ** 2)
    psnr = float(10 * np.log10(255**2 / error)) if error > 0 else float("inf")
    ssim = structural_similarity(
        truth,
        picture,
        channel_axis=2,
        data_range=255,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
    )
    return ImageQuality(psnr, float(ssim))
