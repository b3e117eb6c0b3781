"""What a study found, and its files."""

import errno
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from tbcad.errors import InputError
from tbcad.simulate.study.plots import Panel, plot_png
from tbcad.simulate.study.tables import Table, csv_text


@dataclass(frozen=True)
class Study:
    """A study's findings.

    Attributes:
        name: of its plot.
        summary: tbcad's figures beside the paper's, with columns `tables.SUMMARY`; its name is
            that of the study with "-summary".
        tables: all figures.
        panels: of the plot.
    """

    name: str
    summary: Table
    tables: tuple[Table, ...]
    panels: tuple[Panel, ...]


def check_study_folder(out: Path) -> None:
    """Check, before any work, that files can be written into a folder, which need not exist.

    Raises:
        InputError: they cannot.
    """
    with _in_words(out):
        whole = out.absolute()
        there = next(folder for folder in (whole, *whole.parents) if folder.exists())
        if not there.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, f"{there} is a file")
        if not os.access(there, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, "no right to write there")


def write_study(study: Study, out: Path, more: Mapping[str, bytes] | None = None) -> list[Path]:
    """Write a study's CSV files, notes and plot, and more, into a folder; only these are replaced.

    All are written in full before the first takes its name.

    Raises:
        InputError: the folder cannot be written.
    """
    contents = study_files(study) | dict(more or {})
    with _in_words(out), ExitStack() as undo:
        out.mkdir(parents=True, exist_ok=True)
        new = [(_beside(out / name, data, undo), out / name) for name, data in contents.items()]
        for temporary, path in new:
            os.replace(temporary, path)
    return [path for _, path in new]


def study_files(study: Study) -> dict[str, bytes]:
    """The files of a study by name: the same study gives the same bytes."""
    tables = (study.summary, *study.tables)
    files = {f"{table.name}.csv": csv_text(table).encode() for table in tables}
    notes = [note for table in tables for note in table.notes]
    files[f"{study.name}-notes.txt"] = "".join(f"{note}\n" for note in notes).encode()
    files[f"{study.name}.png"] = plot_png(study.panels)
    return files


def _beside(path: Path, data: bytes, undo: ExitStack) -> Path:
    """A new file beside the one it is to replace; it is removed when it does not."""
    new = path.with_name(f".tbcad-{path.name}-{os.getpid()}.new")
    undo.callback(_removed, new)
    new.write_bytes(data)
    return new


def _removed(path: Path) -> None:
    with suppress(FileNotFoundError):
        path.unlink()


@contextmanager
def _in_words(out: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{out} cannot be written: {reason}: name another folder") from error
