import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tbcad.background import at_once, background_process
from tbcad.spec.errors import SpecError

ROOT = Path(__file__).parents[1]


def write(path: Path, text: str) -> None:
    path.write_text(text)


def refuse(text: str) -> None:
    raise SpecError(text)


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def wait_and_write(path: Path) -> None:
    time.sleep(3)
    path.write_text("too late")


def in_background(
    work: Callable[..., None], *arguments: object, error: type[Exception] | None = None
) -> None:
    """Do some work, and then no more, or fail."""
    with background_process() as submit:
        submit(work, *arguments)
        if error:
            raise error


def test_both_are_done(tmp_path: Path) -> None:
    with background_process() as submit:
        submit(write, tmp_path / "there", "x")
        (tmp_path / "here").write_text("y")
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"there": "x", "here": "y"}


def test_what_it_raises_is_raised() -> None:
    with pytest.raises(SpecError, match="too thin"):
        in_background(refuse, "too thin")
    with pytest.raises(SpecError, match="too thin"):
        at_once(refuse, "too thin")


def test_results_come_in_the_block() -> None:
    with background_process() as submit:
        assert submit(max, 1, 2).result() == at_once(max, 1, 2).result() == 2


def test_a_process_that_dies_is_told() -> None:
    with pytest.raises(RuntimeError, match="ended before"):
        in_background(die)


def test_a_block_that_fails_ends_the_work(tmp_path: Path) -> None:
    with pytest.raises(KeyError):
        in_background(wait_and_write, tmp_path / "late", error=KeyError)
    time.sleep(3.5)
    assert not list(tmp_path.iterdir())


KILLED = """
import os, signal, sys, time
from pathlib import Path
from tbcad.background import background_process
from tests.test_background import wait_and_write, write

with background_process() as submit:
    submit(write, Path(sys.argv[1]) / "begun", "").result()
    submit(wait_and_write, Path(sys.argv[1]) / "late")
    time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems let it finish its work")
def test_it_ends_with_the_process_that_waits(tmp_path: Path) -> None:
    command = [sys.executable, "-c", KILLED, str(tmp_path)]
    killed = subprocess.run(command, check=False, cwd=ROOT)
    assert killed.returncode == -signal.SIGKILL
    assert (tmp_path / "begun").exists()
    time.sleep(4)
    assert not (tmp_path / "late").exists()
