"""Commands and what the system has of memory, threads and processes."""

import errno
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tbcad.app.cli import run

# Page faults while arrays of 16 MB are made and freed again and again.
FAULTS = """
import resource, sys
import numpy as np
from tbcad.app.cli.memory import keep_freed_memory
if sys.argv[1] == "kept":
    keep_freed_memory()
for count in range(60):
    if count == 10:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    many = [np.full(1 << 18, count, dtype=np.float64) for _ in range(8)]
    del many
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="of the GNU C library")
def test_freed_memory_is_used_again() -> None:
    """Without it every array is filled with zeros by the system, page by page, once more."""
    given_back, kept = (
        int(subprocess.check_output([sys.executable, "-c", FAULTS, word]))
        for word in ("given back", "kept")
    )
    assert kept < given_back / 10


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


def test_other_faults_are_not_taken_for_a_shortage(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("a fault of the program")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with pytest.raises(RuntimeError, match="a fault of the program"):
        run(["build", "--n", "4", "--parts", "shell", "--out", "new"])
