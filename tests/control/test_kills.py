"""A run that is killed again and again ends in the same folder as one that is not."""

from collections.abc import Callable
from importlib.util import find_spec
from threading import Event
from time import sleep

import numpy as np
import pytest

from tbcad.cli import run as tbcad
from tests.control.rig import Rig, until
from tests.control.run_checks import check_every_photograph, content, journal

PER_STOP = 12
PHOTOGRAPH = 4  # lines
DELAY_S = 0.008  # in which a photograph comes from the camera to the disk


def killed_run(rig: Rig, camera: str, stops: int, kills: int, seed: int) -> None:
    """Start, kill at random moments, and go on until the end."""
    random = np.random.default_rng(seed)
    each = PER_STOP * stops // kills * PHOTOGRAPH  # lines, so that all kills come in time
    words = rig.words(camera=camera, stops=f"1-{stops}")
    for lines in random.integers(1, rig.controller.lines_before + each, kills).tolist():
        kill_after(rig, words, lines, random.uniform(0, DELAY_S))
        if (rig.out / "run.json").is_file():
            words = rig.words("--resume", camera=camera, stops=None)
    process = rig.start(words)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 0, err


def kill_after(rig: Rig, words: list[str], lines: int, delay_s: float) -> None:
    """Kill a command a moment after its controller has some lines; the next line is not answered.

    So a command that is faster than the process that kills it gets no farther.
    """
    end = len(rig.controller.lines) + lines
    killed = Event()

    def hold(number: int) -> None:
        if number > end:
            killed.wait()

    rig.controller.on_line = hold
    process = rig.start(words)
    until(lambda: len(rig.controller.lines) >= end or process.poll() is not None)
    sleep(delay_s)
    code = process.poll()
    process.kill()
    output = process.communicate()
    rig.controller.on_line = lambda number: None
    killed.set()
    assert code is None, output


def check_killed_run(
    rig: Rig, camera: str, stops: int, kills: int, seed: int, whole: Callable[[list[str]], int]
) -> None:
    """Kill a run often, and compare it with one that `whole` makes at once."""
    killed_run(rig, camera, stops, kills, seed)
    check_every_photograph(rig.out, PER_STOP * stops)
    begun = [one["event"] for one in journal(rig.out) if one["event"] in ("started", "resumed")]
    assert len(begun) > kills // 2
    killed = content(rig.out)
    rig.out.rename(rig.folder / "killed")
    assert whole(rig.words(camera=camera, stops=f"1-{stops}")) == 0
    assert content(rig.out) == killed


def test_five_kills(either_rig: Rig) -> None:
    check_killed_run(either_rig, either_rig.copying, stops=1, kills=5, seed=1, whole=tbcad)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("gphoto2") is None, reason="the extra `machine` is not installed")
def test_fifty_kills(rig: Rig) -> None:
    def whole(words: list[str]) -> int:
        return rig.start(words).wait(timeout=240)

    check_killed_run(rig, "gphoto2", stops=15, kills=50, seed=2, whole=whole)
