"""A rig whose camera sees the photographs of a simulated run, and whose object is turned by hand.

The operator of the rig sits at a terminal, turns the object when the command asks for it, and says
so. The virtual camera gives JPEG files only, and asks for a file's size once: photographs are JPEG
files of the best quality, all filled up to one size.
"""

import io
import os
import pty
import subprocess
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image

from tbcad.rig.runs import read_photograph, read_run
from tests.rig.control.grbl_double import Machine
from tests.rig.control.rig import PICTURE_BYTES, SIZE, Rig, connected_rig
from tests.rig.control.run_checks import OUTPUTS

NEAR_DEG = 0.05  # of a stop: nearer than any two stops are
PROMPT = b"done? [Y/n]:"
STRAIGHT = b"object straight"


def jpeg(pixels: np.ndarray) -> bytes:
    """A JPEG file that keeps each pixel's colour but for rounding, as long as all of them."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=100, subsampling=0, keep_rgb=True)
    data = file.getvalue()
    assert len(data) <= PICTURE_BYTES
    return data.ljust(PICTURE_BYTES, b"\0")


@dataclass
class SimulatedScene:
    """What is to be seen of a simulated run: nothing at angles that it was not photographed at.

    Attributes:
        folder: of the run.
        turned: whether the object is turned by 180 degrees.
    """

    folder: Path
    turned: bool = False
    _angle: np.ndarray = field(init=False)
    _pictures: dict[tuple[bool, int, frozenset[int]], bytes] = field(init=False)

    def __post_init__(self) -> None:
        """Read all of the run's photographs."""
        run = read_run(self.folder)
        every = run.exposures.values()
        stops = {one.frame.stop: one.frame.base_angle_deg for one in every}
        self._angle = np.array([stops[stop] for stop in sorted(stops)])
        self._pictures = {
            (one.frame.object_turn_deg > 0, one.frame.stop, frozenset(OUTPUTS[one.phase])): jpeg(
                read_photograph(run, one)
            )
            for one in every
        }
        self._nothing = jpeg(np.zeros((*SIZE[::-1], 3), np.uint8))

    def __call__(self, machine: Machine) -> bytes:
        """The photograph of a machine."""
        away = np.abs(self._angle - machine.angle)
        stop = int(away.argmin()) + 1
        at = self.turned, stop, frozenset(machine.lights)
        return self._pictures.get(at, self._nothing) if away.min() < NEAR_DEG else self._nothing


@dataclass
class OperatedRig(Rig):
    """A rig with an operator, who is asked.

    Attributes:
        scene: before the camera.
    """

    scene: SimulatedScene

    def words(self, *more: str, camera: str | None = None, stops: str | None = None) -> list[str]:
        """A command line of tbcad that asks."""
        return [
            word for word in super().words(*more, camera=camera, stops=stops) if word != "--yes"
        ]

    def start(
        self,
        words: list[str],
        before: Sequence[str] = (),
        module: str = "tests.rig.control.impatient",
        terminal: int | None = None,
    ) -> "subprocess.Popen[str]":
        """A command in a process of its own, at the operator's terminal."""
        assert terminal is None
        screen, terminal = pty.openpty()
        process = super().start(words, before, module, terminal)
        os.close(terminal)
        threading.Thread(target=self._operate, args=(screen,), daemon=True).start()
        return process

    def _operate(self, screen: int) -> None:
        """Turn the object as the screen says, and answer that it is done."""
        shown = b""
        with suppress(OSError):  # the command has ended
            while data := os.read(screen, 4096):
                shown += data
                if shown.endswith(PROMPT):
                    question = shown.removesuffix(PROMPT).rpartition(b"\n")[2]
                    self.scene.turned = STRAIGHT not in question
                    os.write(screen, b"\n")
                    shown = b""
        os.close(screen)


def operated_rig(export: Path, run: Path, folder: Path, switch_deg: float) -> OperatedRig:
    """A rig that shows a simulated run."""
    scene = SimulatedScene(run)
    rig = connected_rig(export, folder, switch_deg, view=scene)
    return OperatedRig(rig.controller, export, folder, scene)
