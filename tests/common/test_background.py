"""Work in the background: done, or told why not."""

import os
import signal
from pathlib import Path

import pytest
from tbcad_verify.run.processes import at_once

from tbcad.common.schedule import background_processes
from tbcad.core.spec.errors import SpecError


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def refuse(text: str) -> None:
    raise SpecError(text)


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_all_is_done_at_the_end_of_the_block(tmp_path: Path) -> None:
    with background_processes() as submit:
        submit(write, tmp_path / "there", "x")
        write(tmp_path / "here", "y")
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"there": "x", "here": "y"}


def test_what_it_raises_is_raised() -> None:
    with pytest.raises(SpecError, match="too thin"), background_processes() as submit:
        submit(refuse, "too thin")
    with pytest.raises(SpecError, match="too thin"):
        at_once(refuse, "too thin")


def test_a_process_that_dies_is_told() -> None:
    with (
        pytest.raises(RuntimeError, match=r"ended before its work was done: crashed \(SIGKILL\)"),
        background_processes() as submit,
    ):
        submit(die)
