import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tbcad.background import at_once, background_process
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
