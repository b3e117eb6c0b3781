"""Files of plots: kinds, bytes that repeat, colours of the palette."""

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from tbcad.common.figure_files import (
    CYCLE,
    SHADES,
    PlotFormat,
    figure_file,
    legend_below,
    rounded_svg,
    shades,
)

INCHES = (4.0, 3.0)
BEGINNING = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


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


def test_svg_has_places_to_a_hundredth_of_a_point() -> None:
    text = b'<path d="M 12.345678 -9.8" transform="scale(0.015625)"/><use x="1.999999"/>'
    rounded = b'<path d="M 12.34 -9.8" transform="scale(0.015625)"/><use x="1.99"/>'
    assert rounded_svg(text) == rounded
    assert figure_file(draw, INCHES, "svg") == rounded_svg(figure_file(draw, INCHES, "svg"))


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


def test_shades_are_those_of_the_plots() -> None:
    values = np.linspace(-3, 7, 41)
    expected = matplotlib.colormaps[SHADES](np.linspace(0, 1, 41))[:, :3]
    found = np.array([matplotlib.colors.to_rgb(one) for one in shades(values)])
    assert found == pytest.approx(expected, abs=0.07)
