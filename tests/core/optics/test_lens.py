"""Blur of a lens: contrast against closed forms and against scalar waves."""

import numpy as np
import pytest

from tbcad.core.optics.lens import (
    RAY_SHARE,
    PupilLens,
    defocused_mtf,
    diffraction_mtf,
    kernel_factors,
    pixel_kernel,
    pixels_of_samples,
    pupil_points,
)
from tbcad.types import Floats

CUTOFF = 1.47  # cycles a pixel: the pupil and the pixels of n = 18


def contrast(kernel: Floats, frequency: float) -> float:
    """Of lines across the columns, cycles a pixel."""
    at = (np.arange(len(kernel)) + 0.5 - len(kernel) / 2) / 2
    return float(kernel.sum(axis=0) @ np.cos(2 * np.pi * frequency * at))


@pytest.mark.parametrize("frequency", [0.15, 0.25, 0.4, 0.5])
def test_kernel_is_pixel_and_airy_pattern(frequency: float) -> None:
    closed = np.sinc(frequency) * diffraction_mtf(np.array(frequency / CUTOFF))
    assert contrast(pixel_kernel(CUTOFF), frequency) == pytest.approx(closed, abs=0.015)


@pytest.mark.parametrize("separation", [0.75, 1.0, 2.0])
@pytest.mark.parametrize("frequency", [0.15, 0.25, 0.5])
def test_kernel_behind_a_low_pass_filter(separation: float, frequency: float) -> None:
    """Two crossed plates: four images at the corners of a square, |cos(pi s f)| of lines pass."""
    found = contrast(pixel_kernel(CUTOFF, filter_px=separation), frequency)
    plain = contrast(pixel_kernel(CUTOFF), frequency)
    assert found == pytest.approx(plain * np.cos(np.pi * separation * frequency), abs=0.015)


def test_kernel_holds_most_of_the_light() -> None:
    """Of an Airy pattern 1 - J0^2 - J1^2, some 4 %, is beyond 3.5 pixels."""
    assert pixel_kernel(CUTOFF).sum() == pytest.approx(0.955, abs=0.02)


def test_two_products_are_the_kernel() -> None:
    kernel = pixel_kernel(CUTOFF)
    factors = kernel_factors(kernel)
    product = sum(one[-1] * np.outer(one[:-1], one[:-1]) for one in factors)
    assert np.abs(product - kernel).max() < 0.004 * kernel.max()
    one = np.zeros((len(kernel) + 2, len(kernel), 3), dtype=np.float32)
    one[3, 4, 1] = 1.0  # a single sample
    pixels = pixels_of_samples(one, factors, 2)
    assert pixels.shape == (2, 1, 3)
    assert pixels[0, 0, 1] == pytest.approx(product[3, 4], rel=1e-4)
    assert pixels[1, 0, 1] == pytest.approx(product[1, 4], rel=1e-4)
    assert (pixels[..., [0, 2]] == 0).all()


def test_waves_in_focus_are_the_closed_form() -> None:
    share = np.array([0.1, 0.3, 0.7])
    assert defocused_mtf(share, 0.0) == pytest.approx(diffraction_mtf(share), abs=5e-3)


@pytest.mark.parametrize("blur_px", [0.4, 0.8, 1.2, 1.67])
def test_rays_and_airy_pattern_against_waves(blur_px: float) -> None:
    """Up to the finest lines that pixels resolve, within the depths of n = 18 (1.67 pixels)."""
    frequency = np.array([0.125, 0.25, 0.5])
    pitch, pupil = CUTOFF * 550e-6 / 0.853, 0.853
    waves = defocused_mtf(frequency / CUTOFF, pupil * blur_px * pitch / 8 / 550e-6)
    offsets = RAY_SHARE * blur_px / 2 * pupil_points()[..., 0].ravel()
    rays = np.cos(2 * np.pi * frequency[:, None] * offsets).mean(axis=1)
    error = rays * diffraction_mtf(frequency / CUTOFF) - waves
    assert np.abs(error).max() < 0.08
    assert np.abs(error[:2]).max() < 0.03


def test_pupil_is_as_wide_as_a_disc() -> None:
    for fine in (2, 3, 4):
        points = pupil_points(fine).reshape(-1, 2)
        assert points.mean(axis=0) == pytest.approx(0, abs=1e-12)
        assert (points**2).mean(axis=0) == pytest.approx(0.25)


def test_blur_circle() -> None:
    lens = PupilLens(0.8, 125.0)
    assert lens.blur_px(np.array([125.0, 100.0]), 1e-3) == pytest.approx([0, 1.6])
