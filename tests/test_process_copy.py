"""A copy of the process sends progress, results and errors, and never outlives its block."""

import os
import signal
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from tbcad.background import may_fork
from tbcad.own_process import own_process
from tbcad.process_copy import copied_process, next_result
from tbcad.spec.errors import SpecError

with own_process():
    pytestmark = pytest.mark.skipif(not may_fork(), reason="the runner of tests has threads")


def serve(pipe: Connection) -> None:
    pipe.send("begun")
    pipe.send(os.getpid())
    pipe.send(SpecError("refused"))
    if pipe.recv() == "die":
        os.kill(os.getpid(), signal.SIGKILL)


def test_progress_result_error_and_death() -> None:
    heard: list[str] = []
    with copied_process(serve) as pipe:
        assert next_result(pipe, heard.append, "it died") != os.getpid()
        assert heard == ["begun"]
        with pytest.raises(SpecError, match="refused"):
            next_result(pipe, heard.append, "it died")
        pipe.send("die")
        with pytest.raises(RuntimeError, match="it died"):
            next_result(pipe, heard.append, "it died")


def test_it_ends_with_the_block() -> None:
    with copied_process(serve) as pipe:
        process = next_result(pipe, lambda _: None, "it died")
    assert not Path(f"/proc/{process}").exists()
