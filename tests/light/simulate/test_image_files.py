"""Pictures as files, whole or not at all, and how like they are."""

import threading
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence
from scipy.ndimage import gaussian_filter
from skimage.metrics import structural_similarity

from tbcad.light.simulate.image_files import (
    ANIMATED_SUFFIXES,
    write_animation,
)
from tbcad.light.simulate.parallel import first_then_threads, over_chunks
from tbcad.light.simulate.views.viewpoints import (
    equivalent_blur_px,
    image_quality,
    image_quality_map,
)

RED, BLUE = (np.full((24, 32, 3), colour, dtype=np.uint8) for colour in ((255, 0, 0), (0, 0, 255)))


@pytest.mark.parametrize("suffix", ANIMATED_SUFFIXES)
def test_animations_run_forward_and_back(tmp_path: Path, suffix: str) -> None:
    frames = [np.full((24, 32, 3), level, dtype=np.uint8) for level in (0, 80, 160, 240)]
    file = tmp_path / f"film{suffix}"
    write_animation(file, frames)
    with Image.open(file) as film:
        levels = [np.asarray(f.convert("RGB"))[0, 0, 0] for f in ImageSequence.Iterator(film)]
    assert levels == [0, 80, 160, 240, 160, 80]


@pytest.mark.parametrize("level", [0, 90])
def test_pictures_of_nothing_are_not_compared(level: int) -> None:
    even = np.full((24, 32, 3), level, dtype=np.uint8)
    quality, about = image_quality_map(even, even)
    assert np.isnan([quality.psnr_db, quality.ssim]).all()
    assert np.isnan(about).all()
    assert quality.words("true").startswith("nothing to compare")
    assert image_quality(even, even + np.uint8(9)).psnr_db < 40


def test_psnr_in_closed_form() -> None:
    """An error of 10 everywhere: 10 log10(255^2 / 100)."""
    grey = np.full((24, 32, 3), 100, dtype=np.uint8)
    assert image_quality(grey, grey + np.uint8(10)).psnr_db == pytest.approx(28.1308, abs=1e-4)
    assert image_quality(grey, grey + np.uint8(10)).ssim < 1
    small = np.zeros((4, 4, 3), np.uint8)  # than the window: compared whole
    assert 0 < image_quality(small, small + np.uint8(9)).ssim < 1


@pytest.mark.parametrize("shape", [(11, 14, 3), (60, 90, 3)])
def test_ssim_is_that_of_scikit_image(shape: tuple[int, int, int]) -> None:
    """An implementation that shares no code, with the settings of SSIM's authors."""
    rng = np.random.default_rng(3)
    one = rng.integers(0, 256, shape, dtype=np.uint8)
    other = np.clip(one + rng.normal(0, 12, shape), 0, 255).astype(np.uint8)
    ssim, about = structural_similarity(
        *(one, other),
        channel_axis=2,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    quality, ours = image_quality_map(one, other)
    assert quality.ssim == pytest.approx(ssim, abs=1e-12)
    assert ours == pytest.approx(about.mean(axis=2), abs=1e-12)


@pytest.mark.parametrize("sigma", [0.7, 6.0])
def test_equivalent_blur_is_that_of_the_picture(sigma: float) -> None:
    """With noise, too, which no blur explains."""
    rng = np.random.default_rng(2)
    sharp = gaussian_filter(rng.uniform(0, 255, (160, 200, 3)), (2.0, 2.0, 0))
    sharp = (sharp - sharp.min()) / np.ptp(sharp) * 255
    blurred = gaussian_filter(sharp, (sigma, sigma, 0))
    noisy = np.clip(blurred + rng.normal(0, 3, blurred.shape), 0, 255)
    for picture, tolerance in ((blurred, 0.03), (noisy, 0.05)):
        found = equivalent_blur_px(sharp.astype(np.uint8), picture.astype(np.uint8))
        assert found == pytest.approx(sigma, rel=tolerance)


def test_the_first_item_is_done_alone_and_results_are_in_order() -> None:
    done = list[tuple[int, bool]]()

    def work(item: int) -> int:
        done.append((item, threading.current_thread() is threading.main_thread()))
        return item**2

    assert first_then_threads(work, range(20)) == [item**2 for item in range(20)]
    assert first_then_threads(work, []) == []
    numbers = np.arange(20)
    assert over_chunks(lambda part: numbers[part], 20, 3).tolist() == list(range(20))
    assert over_chunks(lambda part: numbers[part], 0, 3).shape == (0,)
    assert done[0] == (0, True)
    assert not any(on_main for _, on_main in done[1:])
