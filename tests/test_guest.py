"""The library is a guest in its user's process: a plain script, with threads, and no main guard."""

import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest

SCRIPT = """
import gc, locale, multiprocessing, signal, sys, threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import tbcad
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_Controller

place, parts, number = Path(sys.argv[1]), sys.argv[2].split(","), int(sys.argv[3])
with (place / "ran.txt").open("a") as file:
    file.write("once\\n")
multiprocessing.set_start_method("spawn")
threading.Thread(target=threading.Event().wait, daemon=True).start()
signal.signal(signal.SIGUSR1, lambda *_: None)
STEPControl_Controller.Init_s()
Interface_Static.SetCVal_s("write.step.schema", "AP242DIS")
locale.setlocale(locale.LC_ALL, "C.UTF-8")
gc.set_threshold(701, 11, 9)


def state():
    return (
        gc.isenabled(), gc.get_threshold(), gc.get_freeze_count(), locale.setlocale(locale.LC_ALL),
        [signal.getsignal(one) for one in sorted(signal.valid_signals())],
        multiprocessing.get_start_method(), multiprocessing.active_children(),
        Interface_Static.CVal_s("write.step.schema"), threading.active_count(),
    )


def build(k):
    spec = tbcad.load_spec(None, ["n=6" if "prototype" in parts else "n=2"])
    return tbcad.build(spec, place / str(k), parts=parts)


before = state()
with ThreadPoolExecutor(number) as pool:
    made = list(pool.map(build, range(number))) if number > 1 else [build(0)]
assert state() == before, (state(), before)
assert all(one.passed for one in made)
"""


# As on a system that is no POSIX; found by Python in this process and all that it starts.
HIDDEN = """
import os, sys

sys.modules.update(dict.fromkeys(("fcntl", "resource", "grp", "pwd", "termios", "pty")))
del os.fork, os.forkpty, os.register_at_fork, os.sched_getaffinity
"""


# A cell of a notebook: no file, and an event loop that runs.
CELL = """
import asyncio

async def cell():
    exec(compile(SCRIPT, "<cell>", "exec"), globals())

asyncio.run(cell())
"""


def run_python(
    place: Path, parts: str, builds: int, code: tuple[str, ...] = (), hidden: bool = False
) -> None:
    """Run some code, or the script as a file."""
    folder, script = place / "path", place / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(HIDDEN if hidden else "", encoding="utf-8")
    command = [sys.executable, *(code or [script]), str(place), parts, str(builds)]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "")
    assert (place / "ran.txt").read_text() == "once\n"


def digests(folder: Path) -> dict[str, str]:
    return {
        file.name: sha256(file.read_bytes()).hexdigest()
        for file in folder.iterdir()
        if file.name != "report.html"  # which says how long the verification took
    }


@pytest.mark.slow
def test_a_build_in_a_script_with_threads_changes_nothing_else(tmp_path: Path) -> None:
    """Without what only a POSIX system has; the next test has it."""
    run_python(tmp_path, "shell", 1, hidden=True)


@pytest.mark.slow
def test_a_build_in_a_notebook(tmp_path: Path) -> None:
    """Its workers have no file to run again, and a loop of events is not theirs."""
    run_python(tmp_path, "shell", 1, ("-c", f"SCRIPT = {SCRIPT!r}\n{CELL}"))


@pytest.mark.slow
def test_two_builds_at_once_write_what_a_command_writes(tmp_path: Path) -> None:
    """Each has processes of its own, which never run the script."""
    run_python(tmp_path, "shell,prototype", 2)
    written = digests(tmp_path / "0")
    assert digests(tmp_path / "1") == written
    main = "import sys; from tbcad.app.cli import main; sys.exit(main())"
    command = [sys.executable, "-c", main, "build", "--n", "6", "--parts", "shell,prototype"]
    subprocess.run([*command, "--out", str(tmp_path / "command"), "--quiet"], check=True)
    assert digests(tmp_path / "command") == written
