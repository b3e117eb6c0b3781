"""From a simulated machine by way of controller and camera to a view of the object.

The camera sees what `tbcad simulate-run` photographs; every step after that is a command. The
object is turned when the base is back at its start after some stops. The virtual camera gives JPEG
files only, and asks for a file's size once: photographs are JPEG files of the best quality, all
filled up to one size.
"""

import io
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run as tbcad
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import MotionSpec
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.reflector import read_export
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
)

NEAR_DEG = 0.05  # of a stop: nearer than any two stops are


def jpeg(pixels: np.ndarray) -> bytes:
    """A JPEG file that keeps each pixel's colour but for rounding, as long as all of them."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=100, subsampling=0, keep_rgb=True)
    data = file.getvalue()
    assert len(data) <= PICTURE_BYTES
    return data.ljust(PICTURE_BYTES, b"\0")


class SimulatedScene:
    """What is to be seen of a simulated run: nothing at angles that it was not photographed at."""

    def __init__(self, folder: Path) -> None:
        self.turned = False  # whether the object is turned by 180 degrees
        self._photographed = False  # whether the base was at a stop since it was below all
        run = read_run(folder)
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
        if away.min() < NEAR_DEG:
            self._photographed = True
        elif self._photographed and machine.angle < self._angle.min():
            self.turned, self._photographed = True, False
        at = self.turned, stop, frozenset(machine.lights)
        return self._pictures.get(at, self._nothing) if away.min() < NEAR_DEG else self._nothing


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("gphoto2") is None, reason="the extra `machine` is missing"),
]

DESIGN = ("n=4", "camera.width_px=416", "camera.height_px=310", "prototype.k=5")
ROUNDING = 2  # levels of 255, by JPEG
LIKE = 0.99  # SSIM of views that differ by rounding


class Loop:
    """One machine that was photographed, and all that follows a run."""

    def __init__(self, rig: Rig, simulated: Path) -> None:
        self.rig, self.simulated = rig, simulated
        process = rig.start(rig.words(camera="gphoto2", stops=None))
        assert "COMPLETE" in process.communicate(timeout=600)[0]
        exports = ("--exports", str(rig.export), "--out", str(self.calibration))
        assert tbcad(["calibrate", str(rig.out), *exports]) == 0

    @property
    def calibration(self) -> Path:
        return self.rig.folder / "calibration"

    def view(self, run: Path, name: str) -> np.ndarray:
        """A view of the merged photographs of a run."""
        captures = self.rig.folder / name
        words = ("--calibration", str(self.calibration), "--exports", str(self.rig.export))
        assert tbcad(["merge", str(run), *words, "--out", str(captures)]) == 0
        size = ("--width", "160", "--height", "120", "--out", str(captures / "view.png"))
        assert tbcad(["view", str(captures), "--azimuth", "30", "--elevation", "40", *size]) == 0
        return np.asarray(Image.open(captures / "view.png"))


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
    yield Loop(Rig(controller, exports, folder), simulated)
    controller.close()


def test_the_camera_gives_what_was_before_it(loop: Loop) -> None:
    """Each stop and light, of both runs."""
    seen, given = (read_run(path) for path in (loop.simulated, loop.rig.out))
    assert not given.faults
    assert given.exposures.keys() == seen.exposures.keys()
    for name, exposure in given.exposures.items():
        before = read_photograph(seen, seen.exposures[name])
        after = read_photograph(given, exposure)
        assert np.abs(after.astype(int) - before).max() <= ROUNDING, name


def test_the_calibration_finds_the_machine_that_was_seen(loop: Loop) -> None:
    """It tells where highlights are, ten times better than the drawing does."""
    truth, frames = read_machine(loop.simulated / "truth.json")
    found, known = read_machine(loop.calibration / "machine.json")
    angles = [[one.base_angle_deg for one in each] for each in (known, frames)]
    assert angles[0] == pytest.approx(angles[1], abs=1e-9)  # written, read and turned
    places = [[(one.object_turn_deg, one.stop) for one in each] for each in (known, frames)]
    assert places[0] == places[1]
    exported = read_export(loop.rig.export)
    drawn = designed_prototype(exported, read_plan(exported))
    assert apart_px(found, truth) < apart_px(drawn, truth) / 10


def apart_px(one: Machine, other: Machine) -> float:
    """How far highlights of two machines are apart, median of all."""
    counts = len(other.angle), len(other.radius), len(other.leds)
    places = [index.ravel() for index in np.indices(counts)]
    apart = one.highlights(*places) - other.highlights(*places)
    return float(np.median(norm(apart)))


def test_the_view_is_that_of_the_simulated_photographs(loop: Loop) -> None:
    """Merged without the way through controller and camera."""
    driven, direct = loop.view(loop.rig.out, "driven"), loop.view(loop.simulated, "direct")
    assert image_quality(direct, driven).ssim > LIKE
