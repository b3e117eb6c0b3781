"""Places of the rays in a pixel: mean and variance of a square convolved with a Gaussian."""

import numpy as np
import pytest

from tbcad.light.reconstruction.rays import pixel_places


@pytest.mark.parametrize("area", [False, True])
@pytest.mark.parametrize("blur_px", [0.45, 2.0])
@pytest.mark.parametrize("count", [3, 12, 40])
def test_mean_and_variance(count: int, blur_px: float, area: bool) -> None:
    places = pixel_places(count, blur_px, area=area).astype(np.float64)
    assert places.shape[1:] == (count, 2)
    assert np.abs(places.mean(axis=1)).max() < 1e-6
    both = (places**2).sum(axis=2).mean(axis=1)
    assert both == pytest.approx(np.full(len(both), 2 * (area / 12 + blur_px**2)), rel=1e-5)
    of_both_ways = (places**2).mean(axis=(0, 1))
    assert of_both_ways[0] == pytest.approx(of_both_ways[1], rel=1e-5)


def test_a_pixel_without_blur_is_its_square() -> None:
    assert np.mean(pixel_places(12).astype(np.float64) ** 2) == pytest.approx(1 / 12)
