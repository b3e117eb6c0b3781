"""Colours of plots: apart for all kinds of colour vision, and from dark to light for shades."""

import numpy as np
import pytest
from matplotlib import colormaps
from skimage.color import rgb2lab

from tbcad.common.figure_files import CYCLE, SHADES, shades

# Colour vision without one kind of cone: Machado and others, IEEE TVCG 15(6), 2009, severity 1,
# for linear light.
VISION = {
    "all cones": np.eye(3),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
JUST_SEEN = 2.3  # difference of colours in CIELAB that is just noticed


def rgb(colours: list[str] | tuple[str, ...]) -> np.ndarray:
    """Red, green, blue of `#rrggbb`, 0 to 1, (m, 3)."""
    return np.array([[int(one[k : k + 2], 16) for k in (1, 3, 5)] for one in colours]) / 255


def as_seen(colours: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """CIELAB of colours (m, 3) as seen with a kind of colour vision."""
    linear = np.where(colours > 0.04045, ((colours + 0.055) / 1.055) ** 2.4, colours / 12.92)
    seen = np.clip(linear @ matrix.T, 0, 1)
    coded = np.where(seen > 0.0031308, 1.055 * seen ** (1 / 2.4) - 0.055, 12.92 * seen)
    return np.asarray(rgb2lab(coded[None])[0])


@pytest.mark.parametrize("vision", VISION)
def test_colours_of_lines_are_apart(vision: str) -> None:
    lab = as_seen(rgb(CYCLE), VISION[vision])
    distance = np.linalg.norm(lab[:, None] - lab, axis=2)[np.triu_indices(len(CYCLE), 1)]
    assert distance.min() > 4 * JUST_SEEN


def test_shades_are_those_of_the_plots() -> None:
    values = np.linspace(-3, 7, 41)
    expected = colormaps[SHADES](np.linspace(0, 1, 41))[:, :3]
    assert rgb(shades(values)) == pytest.approx(expected, abs=0.07)
    assert np.diff(rgb2lab(rgb(shades(values))[None])[0, :, 0]).min() > 0
