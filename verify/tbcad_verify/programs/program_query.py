"""What one program is asked about one kind of file, and the sandbox that it runs in."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tbcad_verify.record.files import locate
from tbcad_verify.report.checks import Check, CheckName, check_names
from tbcad_verify.run.child import Limits, Outcome, run

Command = tuple[str, ...]  # a program's absolute path and first arguments; empty: it is absent


@dataclass(frozen=True)
class ExpectedPart:
    """One part, and what the programs should find in its files."""

    name: str  # of the part
    # "step", "stl", "3mf" -> file name inside the export; missing ones are skipped
    files: Mapping[str, str]
    spheres: int | None  # number of spherical faces of the solid; None: any number
    volume: float  # of the mesh, mm^3; NaN when it is unknown
    volume_error: float  # maximum difference of another file's volume from it, mm^3


@dataclass(frozen=True)
class Sandbox:
    """A private folder with a copy of one file, for one run of one program."""

    command: Command  # how the program's command line starts
    folder: Path  # absolute
    copy: Path  # in the folder. Its name is ours, so that it is never taken for an option.
    file: str  # name of the original inside the export
    limits: Limits  # of the run

    def run(self, *arguments: str | Path) -> Outcome:
        """Run the program with these further arguments."""
        return run([*self.command, *map(str, arguments)], self.folder, self.limits)


@dataclass(frozen=True)
class ProgramQuery:
    """One program and one kind of file."""

    program: str  # its name
    kind: str  # which of a part's files it is given
    install: str  # the command that installs it
    questions: Mapping[str, str]  # name -> unit of the checks it answers, in order
    find: Callable[[], Command]  # returns how to start it
    # runs it and makes the checks of these names; raises Unknown without an answer
    ask: Callable[[Sandbox, ExpectedPart, list[CheckName]], Sequence[Check]]

    def names(self, part: ExpectedPart) -> list[CheckName]:
        """Name, file and unit of every check; a part without such a file by its own name."""
        file = part.files.get(self.kind) or part.name
        return check_names(self.questions, file)


def on_path(*names: str) -> Command:
    """The first of these programs that is installed, by its absolute path."""
    path = next(filter(None, map(shutil.which, names)), None)
    return () if path is None else (str(Path(path).absolute()),)


@contextmanager
def sandbox(
    command: Command, folder: Path, file: str, kind: str, limits: Limits
) -> Iterator[Sandbox]:
    """A sandbox that is deleted afterwards.

    Args:
        command: how the program's command line starts.
        folder: the export, resolved.
        file: name inside it.
        kind: ending of the copy's name.
        limits: of the run.

    Raises:
        BadExport: the file is no regular file inside the export.
    """
    original = locate(folder, file)
    with tempfile.TemporaryDirectory(prefix="tbcad-", ignore_cleanup_errors=True) as name:
        private = Path(name).resolve()
        copy = private / f"given.{kind}"
        shutil.copyfile(original, copy)
        yield Sandbox(command, private, copy, file, limits)
