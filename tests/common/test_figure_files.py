"""Files of plots: kinds, bytes that repeat, colours that are apart for all kinds of vision."""

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from skimage.color import rgb2lab

from tbcad.common.figure_files import CYCLE, SHADES, PlotFormat, figure_file, legend_below, shades

INCHES = (4.0, 3.0)
BEGINNING = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
# Colour vision without one kind of cone: Machado and others, IEEE TVCG 15(6), 2009, severity 1,
# for linear light.
VISION = {
    "all cones": np.eye(3),
    "deuteranopia": np.array(
        [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881]
    ).reshape(3, 3),
}
JUST_SEEN = 2.3  # difference of colours in CIELAB that is just noticed


def draw(figure: Figure) -> None:
    axes = figure.add_subplot()
    for k in range(2):
        axes.plot([0, 1], [k, 1 - k], f"C{k}-", label=f"line {k}")
    axes.set(xlabel="x, mm", ylabel="y, mm", title="title")
    legend_below(axes)


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_the_same_figure_gives_the_same_file_of_each_kind(kind: PlotFormat) -> None:
    first = figure_file(draw, INCHES, kind)
    with matplotlib.rc_context({"lines.linewidth": 9, "svg.hashsalt": "other"}):
        assert figure_file(draw, INCHES, kind) == first
    assert first.startswith(BEGINNING[kind])


def test_colours_are_those_of_the_palette() -> None:
    seen = []

    def note(figure: Figure) -> None:
        axes = figure.add_subplot()
        seen.extend(axes.plot([0, 1], f"C{k}-")[0].get_color() for k in range(len(CYCLE)))
        seen.append(axes.scatter([0, 1], [0, 1], c=[0, 1]).get_cmap().name)

    figure_file(note, INCHES)
    assert [matplotlib.colors.to_hex(c) for c in CYCLE] == list(CYCLE)
    assert seen[-1] == SHADES
    text = figure_file(draw, INCHES, "svg").decode()
    assert all(colour in text for colour in CYCLE[:2])


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
    expected = matplotlib.colormaps[SHADES](np.linspace(0, 1, 41))[:, :3]
    assert rgb(shades(values)) == pytest.approx(expected, abs=0.07)
    assert np.diff(rgb2lab(rgb(shades(values))[None])[0, :, 0]).min() > 0
