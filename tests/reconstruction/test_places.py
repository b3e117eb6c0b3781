"""Places of the rays in a pixel: mean and variance of a square convolved with a Gaussian."""

import numpy as np
import pytest

from tbcad.reconstruction.places import pixel_places


@pytest.mark.parametrize("blur_px", [0.0, 0.45, 2.0])
def test_mean_and_variance(blur_px: float) -> None:
    places = pixel_places(blur_px).astype(np.float64)
    assert places.shape[1:] == (4, 2)
    for half in (places[:, ::2], places[:, 1::2]):
        assert np.abs(half.mean(axis=1)).max() < 1e-6
    variance = (places**2).mean(axis=(0, 1))
    assert variance == pytest.approx(np.full(2, 1 / 12 + blur_px**2), rel=1e-5)
    assert np.abs((places[..., 0] * places[..., 1]).mean()) < 0.05 * variance[0]


def test_halves_are_independent() -> None:
    places = pixel_places(0.45).astype(np.float64)
    squares = (places[:, :2] ** 2).reshape(len(places), 4)
    coordinates = places[:, :2].reshape(len(places), 4)
    for columns in (coordinates, squares):
        between = np.corrcoef(columns.T)[:2, 2:]
        assert np.abs(between).max() < 3 / len(places) ** 0.5


def test_without_blur_all_are_in_the_pixel() -> None:
    assert np.abs(pixel_places()).max() <= 0.51


def test_they_are_the_same_each_time() -> None:
    assert pixel_places(0.3).tobytes() == pixel_places(0.3).tobytes()
