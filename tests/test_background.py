import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from io import RawIOBase
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from tbcad.background import at_once, background_process, may_fork
from tbcad.own_process import is_own_process, own_process
from tbcad.spec.errors import SpecError

ROOT = Path(__file__).parents[1]


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def refuse(text: str) -> None:
    raise SpecError(text)


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def joined_cylinders() -> float:
    """Volume of a row of cylinders."""
    from tbcad.cad.measures import volume
    from tbcad.cad.solids import cylinder, fused

    up = np.array([0.0, 0.0, 1.0])
    return volume(fused([cylinder(np.array([i, 0.0, 0.0]), up, 0.8, 1.0) for i in range(16)]))


def wait_and_write(path: Path) -> None:
    time.sleep(3)
    path.write_text("too late", encoding="utf-8")


def in_background(
    work: Callable[..., None], *arguments: object, error: type[Exception] | None = None
) -> None:
    """Do some work, and then no more, or fail."""
    with own_process(), background_process() as submit:
        submit(work, *arguments)
        if error:
            raise error


def test_both_are_done(tmp_path: Path) -> None:
    with own_process(), background_process() as submit:
        submit(write, tmp_path / "there", "x")
        (tmp_path / "here").write_text("y")
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"there": "x", "here": "y"}


def test_what_it_raises_is_raised() -> None:
    with pytest.raises(SpecError, match="too thin"):
        in_background(refuse, "too thin")
    with pytest.raises(SpecError, match="too thin"):
        at_once(refuse, "too thin")


def test_a_guest_does_it_itself_to_a_copy() -> None:
    """As a process would: what it takes and returns is copied."""
    given = [1]
    with background_process() as submit:
        assert submit(os.getpid).result() == os.getpid()
        taken = submit(list.copy, [given]).result()
    assert taken == [given]
    assert taken[0] is not given
    assert not may_fork()


def test_another_thread_of_a_command_is_a_guest() -> None:
    with own_process(), ThreadPoolExecutor(1) as pool:
        assert not pool.submit(is_own_process).result()
        assert is_own_process()


def test_results_come_in_the_block() -> None:
    with own_process(), background_process() as submit:
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
from tbcad.own_process import own_process
from tests.test_background import wait_and_write, write

with own_process(), background_process() as submit:
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


def test_a_copy_of_a_process_that_has_joined_solids_joins_solids_too() -> None:
    """The kernel's threads are not in the copy, which must not wait for them."""
    volume = joined_cylinders()
    with own_process(), background_process() as submit:
        assert submit(joined_cylinders).result(timeout=60) == volume


ON_A_TERMINAL = """
import time
from tbcad.background import background_process, may_fork
from tbcad.own_process import own_process
from tbcad.screen import stages
from tests import test_background as here

here.copied = True  # known in a copy of this process only
with own_process(), stages({"first": 1.0, "second": 1.0}) as screen:
    screen.stage("first")
    time.sleep(0.3)
    assert may_fork()
    with background_process() as submit:
        assert submit(here.is_copied).result()
        screen.stage("second")
        time.sleep(0.3)
print("done")
"""

copied = False


def is_copied() -> bool:
    return copied


@pytest.mark.skipif(sys.platform != "linux", reason="other systems copy no processes")
def test_a_process_that_draws_progress_on_a_terminal_is_copied_too() -> None:
    """What draws is a thread, which pauses meanwhile, and goes on afterwards."""
    terminal, screen = os.openpty()
    drawn: list[bytes] = []
    with os.fdopen(terminal, "rb", buffering=0) as reader:
        Thread(target=lambda: drawn.extend(chunks_of(reader)), daemon=True).start()
        command = [sys.executable, "-c", ON_A_TERMINAL]
        variables = {**os.environ, "TERM": "xterm", "COLUMNS": "80"}
        done = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=screen, cwd=ROOT, env=variables, check=False
        )
        os.close(screen)
        time.sleep(0.2)
    assert (done.stdout, done.returncode) == (b"done\n", 0), b"".join(drawn)
    assert b"first" in b"".join(drawn)
    assert b"".join(drawn).count(b"second") > 1


def chunks_of(reader: RawIOBase) -> Iterator[bytes]:
    """What can be read, until the other end is closed, which a terminal reports as an error."""
    with suppress(OSError):
        while chunk := reader.read(4096):
            yield chunk
