"""Centroids of spots behind a lens that darkens its edge."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.rig.calibration.detection.matching import Expected, highlights_of
from tbcad.rig.calibration.detection.spots import find_spots

SLOPE = np.array([-0.02, 0.01])  # of the light for a pixel: larger than lenses have
WIDTH_PX = np.array([2.5, 1.5])  # standard deviations of the spot
BLUR_PX = 1.0  # of that, what is no image of a dome
PLACE = np.array([20.3, 18.6])
ONE = np.zeros(1, dtype=np.int64)


def test_a_lens_that_darkens_one_side_does_not_shift_a_highlight() -> None:
    places = np.stack(np.meshgrid(np.arange(40), np.arange(40)), axis=-1) - PLACE
    spot = np.exp(-(places**2 / (2 * WIDTH_PX**2)).sum(axis=-1)) * np.exp(places @ SLOPE)
    image = np.rint(60_000 * spot / spot.max()).astype(np.uint16)
    found, _ = find_spots(np.dstack([image] * 3), None, 0, 0)
    zero = np.zeros((1, 2))
    dome = np.diag(WIDTH_PX**2 - BLUR_PX**2)[None]
    sure = np.ones(1, dtype=bool)
    expected = Expected(ONE, ONE, ONE, zero, zero, dome, zero, np.ones(1), sure)
    darker = replace(expected, brighter=SLOPE[None])
    plain, right = (highlights_of(one, ONE, found, 0.01).pixel[0] for one in (expected, darker))
    assert plain - PLACE == pytest.approx(WIDTH_PX**2 * SLOPE, rel=0.05)
    assert right == pytest.approx(PLACE, abs=0.05 * np.abs(WIDTH_PX**2 * SLOPE).max())
