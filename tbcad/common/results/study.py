"""What a study found, and its files."""

import errno
import os
from dataclasses import astuple, dataclass
from pathlib import Path

from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.common.figure_files import PlotFormat
from tbcad.common.results.plots import PlotPanel, plot_file
from tbcad.common.results.tables import Cell, Table, csv_text

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


def check_study_folder(out: Path) -> None:
    """Check, before any work, that files can be written into a folder, which need not exist.

    Raises:
        InputError: they cannot.
    """
    with write_errors_as_input_errors(out):
        absolute = out.absolute()
        existing = next(folder for folder in (absolute, *absolute.parents) if folder.exists())
        if not existing.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, f"{existing} is a file")
        if not os.access(existing, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, "no right to write there")


def write_study(
    study: Study, out: Path, more: dict[str, bytes] | None = None, plot: PlotFormat = "png"
) -> list[Path]:
    """Write a study's CSV files, notes and plot, and more, into a folder; only these are replaced.

    Raises:
        InputError: the folder cannot be written.
    """
    with write_errors_as_input_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    return replace_files(out, study_files(study, plot) | (more or {}))


def study_files(study: Study, plot: PlotFormat = "png") -> dict[str, bytes]:
    """The files of a study by name: the same study gives the same bytes."""
    tables = (study.summary, *study.tables)
    files = {f"{table.name}.csv": csv_text(table).encode() for table in tables}
    notes = [note for table in tables for note in table.notes]
    files[f"{study.name}-notes.txt"] = "".join(f"{note}\n" for note in notes).encode()
    files[f"{study.name}.{plot}"] = plot_file(study.panels, plot)
    return files
