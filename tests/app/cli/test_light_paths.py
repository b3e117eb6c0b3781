"""Help and bad input are answered before any heavy library is loaded, so that they take no time."""

import errno
import json
import shlex
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.app.cli.endings import shortage
from tests.app.cli.commands import commands

HEAVY = (
    *("numpy", "scipy", "OCP", "build123d", "cadquery", "trimesh", "numba", "pandas", "h5py"),
    *("matplotlib", "pyvista", "embreex", "PIL", "lib3mf", "manifold3d", "distributed"),
)
BAD_INPUT = (Path(__file__).parent / "bad_input.txt").read_text(encoding="utf-8").splitlines()
# Answers commands one after another in one process, each with its exit code, the heavy libraries
# that were loaded until then, and the files of its folder. What was loaded once stays loaded, so
# none must be loaded to the end.
ANSWERS = """
import json, os, sys
from tbcad.app.cli import run
asked, heavy = json.load(sys.stdin)
answers = []
for words in asked:
    code = run(words)
    answers.append((words, code, sorted({*heavy} & sys.modules.keys()), sorted(os.listdir())))
print(json.dumps(answers))
"""
GIVEN = {"broken.toml": "[optics\nn = 3\n", "design.json": "{}"}


def test_no_heavy_library_is_loaded(tmp_path: Path) -> None:
    """Exit code, heavy libraries loaded after it, and files of the folder, of each command."""
    for name, text in GIVEN.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    asked = [*map(shlex.split, BAD_INPUT), *((*words, "--help") for words in commands())]
    done = subprocess.run(
        [sys.executable, "-c", ANSWERS],
        input=json.dumps([asked, HEAVY]),
        capture_output=True, encoding="utf-8", check=True, cwd=tmp_path,
    )  # fmt: skip
    answers = json.loads(done.stdout.splitlines()[-1])
    assert len(answers) == len(asked)
    for words, *answer in answers:
        assert answer == [0 if words[-1] == "--help" else 2, [], sorted(GIVEN)], words


@pytest.mark.parametrize(
    "error",
    [
        RuntimeError("can't start new thread"),
        MemoryError(),
        BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"),
    ],
)
def test_too_few_resources_are_told_in_a_line(
    error: Exception,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As with a small `ulimit -u`: no thread starts, so no build; nothing is left of it."""

    def refuse(thread: threading.Thread) -> None:
        raise error

    monkeypatch.setattr(threading.Thread, "start", refuse)
    assert run(["build", "--n", "4", "--parts", "shell", "--out", str(tmp_path / "new")]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("tbcad: this system has too few resources (")
    assert str(error.args[-1] if error.args else "no memory") in last
    assert list(tmp_path.iterdir()) == []


def test_other_faults_are_not_taken_for_a_shortage() -> None:
    assert shortage(RuntimeError("a fault of the program")) is None
