import os
import signal
import time
from pathlib import Path

import pytest

from tbcad.output.background import in_background
from tbcad.spec.errors import SpecError


def write(path: Path, text: str) -> None:
    path.write_text(text)


def refuse(text: str) -> None:
    raise SpecError(text)


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def wait_and_write(path: Path) -> None:
    time.sleep(3)
    path.write_text("too late")


def test_both_are_done(tmp_path: Path) -> None:
    with in_background(write, tmp_path / "there", "x"):
        (tmp_path / "here").write_text("y")
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"there": "x", "here": "y"}


def test_what_it_raises_is_raised() -> None:
    with pytest.raises(SpecError, match="too thin"), in_background(refuse, "too thin"):
        pass


def test_a_process_that_dies_is_told() -> None:
    with pytest.raises(RuntimeError, match="ended before"), in_background(die):
        pass


def test_a_block_that_fails_ends_the_work(tmp_path: Path) -> None:
    with pytest.raises(KeyError), in_background(wait_and_write, tmp_path / "late"):
        raise KeyError
    time.sleep(3.5)
    assert not list(tmp_path.iterdir())
