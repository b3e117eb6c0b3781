"""From a simulated machine by way of controller, camera and operator to a view of the object.

The camera sees what `tbcad simulate-run` photographs; every step after that is a command. The
operator sits at a terminal, turns the object when the command asks for it, and says so. The virtual
camera gives JPEG files only, and asks for a file's size once: photographs are JPEG files of the
best quality, all filled up to one size.
"""

import io
import os
import pty
import subprocess
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from shutil import move

import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run as tbcad
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import MotionSpec
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.light.simulate.views.viewpoints import image_quality
from tbcad.prototype.balls.layout import prototype_layout
from tbcad.prototype.drive.balance import home_angles
from tbcad.prototype.drive.drive import Drive
from tbcad.rig.machine.designed import designed_prototype
from tbcad.rig.machine.machine import Machine, read_machine
from tbcad.rig.runs import read_photograph, read_run
from tests.rig.control import grbl_double
from tests.rig.control.conftest import export
from tests.rig.control.rig import (
    OUTPUTS,
    PICTURE_BYTES,
    SIZE,
    Rig,
    connected_rig,
    content,
    journal,
    killed_run,
)

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
    """What is to be seen of a simulated run: nothing at angles that it was not photographed at."""

    folder: Path  # of the run
    turned: bool = False  # whether the object is turned by 180 degrees
    _angle: np.ndarray = field(init=False)
    _pictures: dict[tuple[bool, int, frozenset[int]], bytes] = field(init=False)

    def __post_init__(self) -> None:
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

    def __call__(self, machine: grbl_double.Machine) -> bytes:
        """The photograph of a machine."""
        away = np.abs(self._angle - machine.angle)
        stop = int(away.argmin()) + 1
        at = self.turned, stop, frozenset(machine.lights)
        return self._pictures.get(at, self._nothing) if away.min() < NEAR_DEG else self._nothing


@dataclass
class OperatedRig(Rig):
    """A rig with an operator, who is asked."""

    scene: SimulatedScene  # before the camera

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


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("gphoto2") is None, reason="the extra `machine` is missing"),
]

DESIGN = ("n=4", "camera.width_px=416", "camera.height_px=310", "prototype.k=5")
KILLS = 40
ROUNDING = 2  # levels of 255, by JPEG
LIKE = 0.99  # SSIM of views that differ by rounding


class Loop:
    """One machine, photographed at once and with kills."""

    def __init__(self, rig: OperatedRig, stops: int) -> None:
        self.rig, self.stops = rig, stops
        self.simulated = rig.scene.folder
        process = rig.start(rig.words(camera="gphoto2"))
        assert "COMPLETE" in process.communicate(timeout=600)[0]
        self.calibrate_merge_view("whole")
        killed_run(rig, "gphoto2", stops, KILLS, seed=4)
        self.calibrate_merge_view("killed")

    def calibrate_merge_view(self, name: str) -> None:
        """All that follows a run, at the same paths each time, for files may name them."""
        folder = self.rig.folder
        run, calibration, captures = self.rig.out, folder / "calibration", folder / "captures"
        exports = ("--exports", str(self.rig.export))
        assert tbcad(["calibrate", str(run), *exports, "--out", str(calibration)]) == 0
        merged_by = ("--calibration", str(calibration), "--out", str(captures))
        assert tbcad(["merge", str(run), *merged_by]) == 0
        assert self.view(captures) == 0
        (folder / name).mkdir()
        for path in (run, calibration, captures):
            move(path, folder / name)

    def view(self, captures: Path) -> int:
        """A view of the merged photographs, beside them."""
        size = ("--width", "160", "--height", "120", "--out", str(captures / "view.png"))
        return tbcad(["view", str(captures), "--azimuth", "30", "--elevation", "40", *size])

    @property
    def exported(self) -> ExportedDesign:
        return read_export(self.rig.export)

    def folder(self, name: str, what: str) -> Path:
        return self.rig.folder / name / what


@pytest.fixture(scope="module")
def loop(drive: Drive, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Loop]:
    folder = tmp_path_factory.mktemp("loop")
    small = design(load_spec(None, list(DESIGN)))
    layout = prototype_layout(small.spec, small)
    exports = export(folder / "exports", small, layout, drive, MotionSpec())
    simulated = folder / "simulated"
    assert tbcad(["simulate-run", str(exports), "--seed", "3", "--out", str(simulated)]) == 0
    switch = home_angles(layout, MotionSpec()).switch
    scene = SimulatedScene(simulated)
    controller = connected_rig(exports, folder, switch, view=scene).controller
    rig = OperatedRig(controller, exports, folder, scene)
    yield Loop(rig, len(layout.stops.angle))
    rig.controller.close()


def test_the_camera_gives_what_was_before_it(loop: Loop) -> None:
    """Each stop and light, of both runs: the operator turned the object between them."""
    seen, given = (read_run(path) for path in (loop.simulated, loop.folder("whole", "run")))
    assert not given.faults
    assert given.exposures.keys() == seen.exposures.keys()
    for name, exposure in given.exposures.items():
        before = read_photograph(seen, seen.exposures[name])
        after = read_photograph(given, exposure)
        assert np.abs(after.astype(int) - before).max() <= ROUNDING, name


def test_kills_leave_the_same_photographs(loop: Loop) -> None:
    killed = loop.folder("killed", "run")
    lines = journal(killed)
    assert [one["event"] for one in lines].count("resumed") > KILLS // 2
    assert content(killed) == content(loop.folder("whole", "run"))


@pytest.mark.parametrize("file", ["captures/lightfield.h5", "captures/view.png"])
def test_kills_leave_the_same_light_field_byte_for_byte(loop: Loop, file: str) -> None:
    whole, killed = (loop.folder(name, file).read_bytes() for name in ("whole", "killed"))
    assert whole == killed


def test_the_calibration_finds_the_machine_that_was_seen(loop: Loop) -> None:
    """It tells where highlights are, ten times better than the drawing does."""
    truth, frames = read_machine(loop.simulated / "truth.json")
    found, known = read_machine(loop.folder("whole", "calibration") / "machine.json")
    angles = [[one.base_angle_deg for one in each] for each in (known, frames)]
    assert angles[0] == pytest.approx(angles[1], abs=1e-9)  # written, read and turned
    places = [[(one.object_turn_deg, one.stop) for one in each] for each in (known, frames)]
    assert places[0] == places[1]
    drawn = designed_prototype(loop.exported, read_plan(loop.exported))
    assert apart_px(found, truth) < apart_px(drawn, truth) / 10


def apart_px(one: Machine, other: Machine) -> float:
    """How far highlights of two machines are apart, median of all."""
    counts = len(other.angle), len(other.radius), len(other.leds)
    places = [index.ravel() for index in np.indices(counts)]
    apart = one.highlights(*places) - other.highlights(*places)
    return float(np.median(norm(apart)))


def test_the_view_is_that_of_the_simulated_photographs(loop: Loop) -> None:
    """Merged without the way through controller, camera and operator."""
    merged = loop.rig.folder / "direct"
    calibration = loop.folder("whole", "calibration")
    words = ("--calibration", str(calibration), "--exports", str(loop.rig.export))
    assert tbcad(["merge", str(loop.simulated), *words, "--out", str(merged)]) == 0
    assert loop.view(merged) == 0
    direct, driven = (
        np.asarray(Image.open(path / "view.png"))
        for path in (merged, loop.folder("whole", "captures"))
    )
    assert image_quality(direct, driven).ssim > LIKE
