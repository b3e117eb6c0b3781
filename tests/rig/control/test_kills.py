"""A run that is killed again and again ends in the same folder as one that is not."""

from threading import Event
from time import sleep

import numpy as np
import pytest

from tbcad.app.cli import run as tbcad
from tests.rig.control.rig import Rig, check_every_photograph, content, journal, until

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
    _, err = process.communicate(timeout=600)
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


@pytest.mark.slow
def test_three_kills(either_rig: Rig) -> None:
    """Forty of them, with the virtual camera, are in test_whole_loop."""
    rig, kills = either_rig, 3
    killed_run(rig, rig.copying, stops=1, kills=kills, seed=1)
    check_every_photograph(rig.out, PER_STOP)
    begun = [one["event"] for one in journal(rig.out) if one["event"] in ("started", "resumed")]
    assert len(begun) > kills // 2
    killed = content(rig.out)
    rig.out.rename(rig.folder / "killed")
    assert tbcad(rig.words(stops="1")) == 0
    assert content(rig.out) == killed
