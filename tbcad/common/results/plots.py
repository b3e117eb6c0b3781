"""Plots as data, and as PNG, SVG or PDF files whose bytes repeat."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tbcad.common.figure_files import PlotFormat, figure_file, legend_below
from tbcad.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


PANEL_INCHES = (6.4, 5.2)
MARKER_POINTS, CROSS_POINTS = 4, 7


@dataclass(frozen=True)
class Series:
    """Points or a line."""

    label: str  # for the legend; "" for none
    x: Floats  # values, (k,)
    y: Floats  # values, (k,); NaN where there is none
    style: str = "-"  # matplotlib's letters for colour, marker and line; "bars" for bars from zero
    shade: Floats | None = None  # values that colour the points, (k,); None for one colour
    shade_label: str = ""  # what they are, with their unit


@dataclass(frozen=True)
class PlotPanel:
    """One pair of axes."""

    title: str  # what is shown
    x_label: str  # with its unit
    y_label: str  # with its unit
    series: tuple[Series, ...]  # what is drawn, the first lowest
    logarithmic: str = ""  # axes that are: "", "x", "y" or "xy"
    # of the places 0, 1, 2 ... on the y axis, the first on top; () for numbers.
    names: tuple[str, ...] = ()


def plot_file(panels: tuple[PlotPanel, ...], kind: PlotFormat = "png") -> bytes:
    """Panels side by side as a file; the same panels give the same bytes."""
    width, height = PANEL_INCHES

    def draw(figure: "Figure") -> None:
        for place, panel in enumerate(panels, 1):
            _draw(figure.add_subplot(1, len(panels), place), panel)

    return figure_file(draw, (width * len(panels), height), kind)


def _draw(axes: "Axes", panel: PlotPanel) -> None:
    for series in panel.series:
        _draw_series(axes, series)
    if panel.names:
        axes.set_yticks(range(len(panel.names)), panel.names)
        axes.invert_yaxis()
    for letter in panel.logarithmic:
        _logarithmic(axes, letter)
    axes.set_title(panel.title)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.grid(True, which="both", alpha=0.25)
    if any(series.label for series in panel.series):
        legend_below(axes)


def _draw_series(axes: "Axes", series: Series) -> None:
    label = series.label or None
    if series.shade is not None:
        points = axes.scatter(series.x, series.y, c=series.shade, s=9, label=label)
        axes.figure.colorbar(points, ax=axes, label=series.shade_label)
        axes.set_aspect("equal")
    elif series.style == "bars":
        axes.barh(series.y, series.x, height=0.7, label=label)
    else:
        size = CROSS_POINTS if set(series.style) & set("x+") else MARKER_POINTS
        axes.plot(series.x, series.y, series.style, label=label, markersize=size)


def _logarithmic(axes: "Axes", letter: str) -> None:
    """A logarithmic axis with plain numbers at 1, 2, 5, 10, ..."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set(**{f"{letter}scale": "log"})
    axis = axes.xaxis if letter == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.10g}"))
    axis.set_minor_formatter(NullFormatter())
