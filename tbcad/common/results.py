"""Results as tables, plots, and the files of a study; the same results give the same bytes."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.common.figure_files import PlotFormat, figure_file, legend_below
from tbcad.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas


Cell = str | int | float | None
Record = dict[str, Cell]


@dataclass(frozen=True)
class Table:
    """A table."""

    name: str  # of its file, without the ending
    columns: tuple[str, ...]  # names; units are in them
    rows: tuple[tuple[Cell, ...], ...]  # cells in the columns' order; None where there is no value
    notes: tuple[str, ...] = ()  # what the figures mean and assume, a sentence or two each

    @staticmethod
    def of_columns(
        name: str, columns: Mapping[str, ArrayLike], notes: tuple[str, ...] = ()
    ) -> "Table":
        """A table of columns of one length; NaN becomes an empty cell."""
        values = [np.asarray(column).tolist() for column in columns.values()]
        rows = (
            tuple(None if isinstance(cell, float) and math.isnan(cell) else cell for cell in row)
            for row in zip(*values, strict=True)
        )
        return Table(name, tuple(columns), tuple(rows), notes)

    @staticmethod
    def of_records(
        name: str,
        records: Sequence[Record],
        notes: tuple[str, ...] = (),
        columns: tuple[str, ...] = (),
    ) -> "Table":
        """A table of rows with the same keys; `columns` are needed where there may be no row."""
        names = columns or tuple(records[0])
        return Table(name, names, tuple(tuple(map(r.__getitem__, names)) for r in records), notes)

    def records(self) -> list[Record]:
        """The rows by the names of the columns."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]

    def column(self, name: str) -> list[Cell]:
        """The cells of one column."""
        place = self.columns.index(name)
        return [row[place] for row in self.rows]

    def numbers(self, name: str) -> Floats:
        """The cells of one column as numbers, (k,); NaN where there is no value."""
        return np.array([math.nan if c is None else float(c) for c in self.column(name)])

    def where(self, **cells: Cell) -> "Table":
        """The rows that have these cells in these columns."""
        places = {self.columns.index(name): cell for name, cell in cells.items()}
        rows = (r for r in self.rows if all(r[place] == cell for place, cell in places.items()))
        return Table(self.name, self.columns, tuple(rows), self.notes)


def csv_text(table: Table) -> str:
    """A table as CSV, numbers in full precision; a cell without a value is empty."""
    file = StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return file.getvalue()


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


def plot_file(panels: tuple[PlotPanel, ...], kind: PlotFormat = "svg") -> bytes:
    """Panels side by side as a file; the same panels give the same bytes."""
    width, height = PANEL_INCHES

    def draw(figure: "Canvas") -> None:
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


SUMMARY_COLUMNS = ("quantity", "unit", "tbcad", "paper", "where")


@dataclass(frozen=True)
class Figure:
    """A figure that a study measured, beside the paper's."""

    quantity: str  # what it is
    unit: str  # "" for numbers without one
    value: Cell  # as measured; None where there is none
    paper: Cell = None  # as the paper states it; None where it does not
    where: str = ""  # place in the paper


@dataclass(frozen=True)
class Study:
    """A study's findings."""

    name: str  # of its files
    figures: tuple[Figure, ...]  # the most important ones, beside the paper's
    tables: tuple[Table, ...]  # all figures
    panels: tuple[PlotPanel, ...]  # of the plot
    notes: tuple[str, ...] = ()  # what the figures mean, besides the notes of the tables

    @property
    def summary(self) -> Table:
        """The figures as a table."""
        rows = tuple(astuple(figure) for figure in self.figures)
        return Table(f"{self.name}-summary", SUMMARY_COLUMNS, rows, self.notes)


def write_study(
    study: Study, out: Path, more: dict[str, bytes] | None = None, plot: PlotFormat = "svg"
) -> list[Path]:
    """Write a study's CSV files, notes and plot, and more, into a folder; only these are replaced.

    InputError: the folder cannot be written.
    """
    with write_errors_as_input_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    return replace_files(out, study_files(study, plot) | (more or {}))


def study_files(study: Study, plot: PlotFormat = "svg") -> dict[str, bytes]:
    """The files of a study by name: the same study gives the same bytes."""
    tables = (study.summary, *study.tables)
    files = {f"{table.name}.csv": csv_text(table).encode() for table in tables}
    notes = [note for table in tables for note in table.notes]
    files[f"{study.name}-notes.txt"] = "".join(f"{note}\n" for note in notes).encode()
    files[f"{study.name}.{plot}"] = plot_file(study.panels, plot)
    return files
