"""Calls in other processes: results, errors, crashes, time limits and ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from tbcad_verify.run.processes import ProcessEnded, Processes

LONG = "x" * 1_000_000  # more than a pipe holds


def report_twice(report: Callable[[str], None]) -> str:
    print("what libraries print is no answer")
    for _ in range(2):
        report(LONG)
    return LONG


def refuse(text: str) -> None:
    raise ValueError(text)


def end(how: str) -> str:
    match how:
        case "crash":
            os.kill(os.getpid(), signal.SIGKILL)
        case "exit":
            os._exit(3)
        case "hang":
            time.sleep(60)
    return how


def meet(mine: Path, other: Path) -> bool:
    mine.touch()
    while not other.exists():
        time.sleep(0.01)
    return True


def wait_and_touch(begun: Path, late: Path) -> None:
    begun.touch()
    time.sleep(3)
    late.touch()


def test_a_process_that_begins_while_all_are_ended_ends_too() -> None:
    processes = Processes(1)
    processes.kill()
    with pytest.raises(ProcessEnded, match="SIGKILL"):
        processes.call(end, "hang")


def test_nothing_waits_for_a_time_limit(tmp_path: Path) -> None:
    """An interrupt may come before anything can cancel it: it must not keep a program alive."""
    mine, other = tmp_path / "mine", tmp_path / "other"
    with Processes(1, 60) as processes:
        done = processes.submit(meet, mine, other)
        while not mine.exists():
            time.sleep(0.01)
        timers = [one for one in threading.enumerate() if isinstance(one, threading.Timer)]
        assert timers
        assert all(one.daemon for one in timers)
        other.touch()
        assert done.result()


def test_reports_results_and_errors() -> None:
    heard: list[str] = []
    with Processes(1) as processes:
        assert processes.call(report_twice, heard=heard.append) == LONG
        assert heard == [LONG, LONG]
        with pytest.raises(ValueError, match="too thin") as error:
            processes.submit(refuse, "too thin").result()
        assert "raise ValueError(text)" in error.value.__notes__[0]
        first = processes.submit(os.getpid).result()
        assert first == processes.submit(os.getpid).result() != os.getpid()
    assert not Path(f"/proc/{first}").exists()


def test_each_ends_alone() -> None:
    with Processes(2, 2.0) as processes:
        asked = {how: processes.submit(end, how) for how in ("hang", "one", "crash", "two", "exit")}
        errors = {how: str(one.exception() or one.result()) for how, one in asked.items()}
    assert errors == {
        "hang": "no answer within 2 s",
        "crash": "crashed (SIGKILL)",
        "exit": "ended with exit code 3",
        "one": "one",
        "two": "two",
    }


def test_idle_processes_go_on_elsewhere() -> None:
    with Processes(1) as before:
        own = before.call(os.getpid)
        with Processes(2, 30.0, before) as after:
            assert after.call(os.getpid) == own
            with pytest.raises(ProcessEnded, match="SIGKILL"):
                after.call(end, "crash")
            assert after.call(os.getpid) not in (own, os.getpid())
        assert before.call(os.getpid) != own


def test_all_work_at_once(tmp_path: Path) -> None:
    places = tmp_path / "a", tmp_path / "b"
    with Processes(2) as processes:
        asked = [processes.submit(meet, *some) for some in (places, places[::-1])]
        assert all(one.result(timeout=60) for one in asked)


def test_a_block_that_fails_ends_all(tmp_path: Path) -> None:
    with pytest.raises(KeyError), Processes(1) as processes:  # noqa: PT012
        working = processes.submit(wait_and_touch, tmp_path / "begun", tmp_path / "late")
        meet(tmp_path / "here", tmp_path / "begun")
        raise KeyError
    assert isinstance(working.exception(), ProcessEnded)


KILLED = """
import os, signal, sys
from pathlib import Path
from tbcad_verify.run.processes import Processes
from tests.verify.run.test_processes import meet, wait_and_touch

place = Path(sys.argv[1])
with Processes(1) as processes:
    processes.submit(wait_and_touch, place / "begun", place / "late")
    meet(place / "here", place / "begun")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_they_end_with_their_parent(tmp_path: Path) -> None:
    command = [sys.executable, "-c", KILLED, str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    killed = subprocess.run(command, check=False, env=environment)
    assert killed.returncode == -signal.SIGKILL
    time.sleep(4)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["begun", "here"]


ALONE = """
import os
from tbcad_verify.run.processes import Processes

try:
    import resource
    if os.getuid() == 0:
        os.setuid(65534)
    resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
except ImportError:
    print("no limit")
heard = []
with Processes(2) as processes:
    given = [1]
    taken = processes.submit(list.copy, [given]).result()[0]
    assert taken == given and taken is not given  # to a copy, as in a process
    assert processes.call(os.getpid) == os.getpid()
print("done")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the limit is Linux's")
def test_where_no_process_can_be_started_the_work_is_done_here() -> None:
    done = subprocess.run([sys.executable, "-c", ALONE], capture_output=True, check=False)
    assert (done.stdout, done.returncode) == (b"done\n", 0), done.stderr.decode()
