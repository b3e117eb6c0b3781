"""Questions to one program about one kind of file, its sandbox, and its answers.

What a program does not answer clearly is unknown.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tbcad_verify.record.files import locate
from tbcad_verify.report.checks import Check, CheckName, Unknown, check_names, informative
from tbcad_verify.run.child import Limits, Outcome, run

Command = tuple[str, ...]  # a program's absolute path and first arguments; empty: it is absent
SKIPPED = "skipped: "
NO_ANSWER = "ended without error, but left no readable answer"
# The end of our scripts inside programs. They define `look`, which returns figures, and `message`.
SCRIPT_END = """
try:
    answer = look()
except BaseException as error:
    answer = {"error": type(error).__name__ + ": " + message(error)}
with open("answer.json", "w") as stream:
    json.dump(answer, stream)
sys.exit(3 if "error" in answer else 0)
"""
MAX_ANSWER = 100_000  # bytes
SHOWN = 160  # characters of a program's own message


@dataclass(frozen=True)
class ExpectedPart:
    """One part, and what the programs should find in its files."""

    name: str  # of the part
    # "step", "stl", "3mf" -> file name inside the build; missing ones are skipped
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
    file: str  # name of the original inside the build
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

    BadExport: the file is no regular file inside the build.
    """
    original = locate(folder, file)
    with tempfile.TemporaryDirectory(prefix="tbcad-", ignore_cleanup_errors=True) as name:
        private = Path(name).resolve()
        copy = private / f"given.{kind}"
        shutil.copyfile(original, copy)
        yield Sandbox(command, private, copy, file, limits)


def skipped(check: CheckName, reason: str) -> Check:
    """A check that could not be made: no failure, and no figure either."""
    return informative(check, math.nan, SKIPPED + reason)


def is_skipped(check: Check) -> bool:
    """Whether `skipped` made it: it should not be shown like a pass."""
    return check.measured is None and check.detail.startswith(SKIPPED)


def text_of(outcome: Outcome) -> str:
    """The output of a program that ended without error. Unknown: it did not."""
    if outcome.reason:
        raise Unknown(outcome.reason)
    if outcome.code != 0:
        raise Unknown(_gave_up(outcome, _last_line(outcome.text)))
    return outcome.text


def script_figures(outcome: Outcome, folder: Path, keys: Sequence[str]) -> dict[str, float]:
    """The numbers that a script of ours wrote inside a program, as a JSON object.

    Unknown: it crashed, broke or left no such answer.
    """
    answer = _object(folder / "answer.json") if outcome.code is not None else {}
    if outcome.code and isinstance(answer.get("error"), str):
        raise Unknown(_gave_up(outcome, _last_line(answer["error"])))
    text_of(outcome)
    if not all(_is_number(answer.get(key)) for key in keys):
        raise Unknown(NO_ANSWER)
    return {key: float(answer[key]) for key in keys}


def _object(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as stream:
            value = json.loads(stream.read(MAX_ANSWER))
    except (OSError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def _is_number(value: Any) -> bool:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    return good and abs(value) < 1e300  # False for NaN too


def _gave_up(outcome: Outcome, last: str) -> str:
    return f"gave up with exit status {outcome.code}" + (f": {last}" if last else "")


def _last_line(text: str) -> str:
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    lines = ["".join(c for c in line if c.isprintable()).strip() for line in plain.splitlines()]
    return ([line for line in lines if line] or [""])[-1][:SHOWN]
