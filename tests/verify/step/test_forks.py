"""Forks that crash, raise or hang end alone."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from tbcad_verify.step.forks import for_each


def work(file: Path, answer: Path) -> None:
    match file.name:
        case "crash":
            os.kill(os.getpid(), signal.SIGKILL)
        case "raise":
            os._exit(3)
        case "hang":
            time.sleep(60)
    answer.write_text(file.name, encoding="utf-8")


@pytest.mark.parametrize("processes", [1, 3])
@pytest.mark.parametrize("size", [1, 2, 4, 6])
def test_each_ends_alone(tmp_path: Path, processes: int, size: int) -> None:
    """Also those that share a fork."""
    names = ["hang", "one", "crash", "two", "raise", "three"]
    pairs = [(Path(name), tmp_path / name) for name in names]
    batches = [pairs[start : start + size] for start in range(0, len(pairs), size)]
    ended = list(for_each(work, batches, 1.0, processes))
    assert len(ended) == len(names)
    ends = {pair[0].name: reason for pair, reason in ended}
    assert ends == {
        "hang": "no answer within 1 s",
        "crash": "crashed (SIGKILL)",
        "raise": "ended with exit code 3",
        "one": "",
        "two": "",
        "three": "",
    }
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "three", "two"]


def test_all_work_at_once(tmp_path: Path) -> None:
    def meet(mine: Path, other: Path) -> None:
        mine.touch()
        while not other.exists():
            time.sleep(0.01)

    pair = tmp_path / "a", tmp_path / "b"
    assert [reason for _, reason in for_each(meet, [[pair], [pair[::-1]]], 10, 2)] == ["", ""]


def test_jobs_of_a_batch_have_their_own_time(tmp_path: Path) -> None:
    def slow(answer: Path) -> None:
        time.sleep(0.4)
        answer.touch()

    jobs = [(tmp_path / str(k),) for k in range(4)]
    assert list(for_each(slow, [jobs], 1.0, 1)) == [(job, "") for job in jobs]


def test_a_batch_is_one_fork(tmp_path: Path) -> None:
    def say(answer: Path) -> None:
        answer.write_text(str(os.getpid()), encoding="utf-8")

    jobs = [(tmp_path / str(k),) for k in range(4)]
    assert len(list(for_each(say, [jobs[:3], jobs[3:]], 10, 2))) == len(jobs)
    first, *_, last = ids = [job[0].read_text(encoding="utf-8") for job in jobs]
    assert ids == [first, first, first, last]
    assert first != last
