"""A child cannot hang us, flood us, outlive us, or see and change what is the user's."""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path

import pytest
from tbcad_verify.run.child import Limits, Outcome, run

LATE = "no answer within 2 s"


def python(folder: Path, body: str, limits: Limits | None = None) -> Outcome:
    return run([sys.executable, "-IS", "-c", body], folder, limits or Limits(300))


def is_alive(pid: int) -> bool:
    """False for what has gone and for what nobody has waited for yet."""
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
            != "Z"
        )
    except OSError:
        return False


def gone_soon(pid: int) -> bool:
    deadline = time.monotonic() + 300
    while is_alive(pid) and time.monotonic() < deadline:
        time.sleep(0.01)
    return not is_alive(pid)


@pytest.mark.parametrize(
    ("body", "seconds", "end", "said"),
    [
        ("sys.stderr.write('err '); print('out'); sys.exit(7)", 300, (7, ""), ["err", "out"]),
        ("os.kill(os.getpid(), 11)", 300, (None, "crashed (SIGSEGV)"), []),
        ("print('soon', flush=True); time.sleep(900)", 2, (None, LATE), ["soon"]),
    ],
)
def test_ends_are_told(
    tmp_path: Path, body: str, seconds: float, end: tuple[int | None, str], said: list[str]
) -> None:
    start = time.monotonic()
    done = python(tmp_path, f"import os, sys, time; {body}", Limits(seconds))
    assert (done.code, done.reason) == end
    assert sorted(done.text.split()) == said
    assert 0 < done.seconds <= time.monotonic() - start < 600


SPAWN = """
import subprocess, sys, time
child = subprocess.Popen([sys.executable, "-IS", "-c", "import time; time.sleep(900)"])
print(child.pid, flush=True)
"""


@pytest.mark.parametrize(("rest", "reason"), [("time.sleep(900)", LATE), ("", "")])
def test_grandchildren_do_not_outlive_a_child(tmp_path: Path, rest: str, reason: str) -> None:
    """Nor do they keep us waiting: this one holds the pipe open."""
    start = time.monotonic()
    done = python(tmp_path, SPAWN + rest, Limits(2))
    assert done.reason == reason
    assert time.monotonic() - start < 600
    assert gone_soon(int(done.text))


def test_printing_has_an_end(tmp_path: Path) -> None:
    done = python(tmp_path, "while True: print('y' * 1000)", Limits(600, output=5000))
    assert done.reason == "printed more than 5000 bytes"
    assert len(done.text) == 5000


@pytest.mark.parametrize("command", ["missing", "no_program", "nul\0nul"])
def test_what_cannot_be_started(tmp_path: Path, command: str) -> None:
    (tmp_path / "no_program").write_text("words")
    done = run([f"{tmp_path}/{command}"], tmp_path, Limits(5))
    assert done.code is None
    assert done.reason.startswith("cannot be started")


def test_home_is_private_and_nothing_is_there_to_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    body = (
        "import json, os, sys; print(json.dumps([dict(os.environ), os.getcwd(), sys.stdin.read()]))"
    )
    environment, where, said = json.loads(python(tmp_path, body).text)
    assert said == ""
    assert where == "."  # places are left out of what is shown
    assert {"DISPLAY", "PYTHONPATH"}.isdisjoint(environment)
    own = ["HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "FREECAD_USER_HOME"]
    assert all(environment[name].startswith("./home") for name in own)
    assert environment["PATH"] == os.environ["PATH"]


def test_stop_kills_what_runs_and_starts_no_more(tmp_path: Path) -> None:
    limits = Limits(60)
    threading.Timer(0.3, limits.stop.set).start()
    start = time.monotonic()
    assert python(tmp_path, "import time; time.sleep(60)", limits).reason == "stopped"
    assert python(tmp_path, "open('ran', 'w')", limits).reason == "stopped"
    assert time.monotonic() - start < 5
    assert not (tmp_path / "ran").exists()
