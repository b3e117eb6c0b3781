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
def test_each_ends_alone(tmp_path: Path, processes: int) -> None:
    names = ["hang", "one", "crash", "two", "raise", "three"]
    pairs = [(Path(name), tmp_path / name) for name in names]
    ends = {pair[0].name: reason for pair, reason in for_each(work, pairs, 1.0, processes)}
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
    assert [reason for _, reason in for_each(meet, [pair, pair[::-1]], 10, 2)] == ["", ""]
