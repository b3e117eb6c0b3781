"""Light that is spread keeps its sum and its place, and gets the width of the filter."""

import numpy as np
import pytest

from tbcad.rig.simulated_run.photographs import PointSpread, add_points, blurred

# So wide that sums over pixels are integrals: what is left of one cycle a pixel is 6e-5.
SPREAD = PointSpread(separation_px=1.0, lens_px=0.7)


def spread_point(place: tuple[float, float]) -> np.ndarray:
    image = np.zeros((21, 31), dtype=np.float32)
    add_points(image, np.array([place]), np.array([2.0]), SPREAD)
    return image


@pytest.mark.parametrize("place", [(15.0, 10.0), (14.3, 9.8), (15.49, 10.51)])
def test_sum_centroid_and_width(place: tuple[float, float]) -> None:
    image = spread_point(place)
    row, column = np.indices(image.shape)
    assert image.sum() == pytest.approx(2, rel=1e-4)
    assert (image * column).sum() / 2 == pytest.approx(place[0], abs=2e-3)
    assert (image * row).sum() / 2 == pytest.approx(place[1], abs=2e-3)
    # Variances add: two images half a pixel to each side, the lens, a pixel's width.
    width = (image * (column - place[0]) ** 2).sum() / 2
    assert width == pytest.approx(0.5**2 + 0.7**2 + 1 / 12, rel=2e-3)


def test_light_beyond_the_edge_is_lost() -> None:
    assert spread_point((-0.5, 10.0)).sum() == pytest.approx(1, rel=1e-4)
    assert spread_point((-9.0, 10.0)).sum() == 0


def test_a_picture_is_blurred_as_points_are() -> None:
    picture = np.zeros((21, 31, 3), dtype=np.float32)
    picture[10, 15] = (2.0, 1.0, 0.5)
    found = blurred(picture, SPREAD)
    assert found[..., 0] == pytest.approx(spread_point((15.0, 10.0)), abs=1e-5)
    assert found.sum(axis=(0, 1)) == pytest.approx([2, 1, 0.5], rel=1e-4)
