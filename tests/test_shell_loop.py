"""The whole loop of a shell: both photographs of a random build, calibration, merge, views."""

from pathlib import Path
from shutil import copy

import numpy as np
import pytest

from tbcad.app.api import calibrate, merge, simulate_run
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.rig.machine.machine import read_machine
from tbcad.rig.simulated_run.photographs import OBJECT_LIGHT
from tbcad.rig.simulated_run.simulate import run_object
from tests.view_quality import mean_ssim

pytestmark = pytest.mark.slow

DESIGN = ("n=5", "camera.width_px=832", "camera.height_px=620")
PROCESS = "fdm"
ALLOWED = 0.01  # of SSIM, between a calibrated and the true machine
CAMERAS = ("a", "b")


class ShellLoop:
    """A run of a random build, and the machines that its photographs may be merged by."""

    def __init__(self, folder: Path, edges: str) -> None:
        self.folder, self.export = folder, folder / "exports"
        self.export.mkdir()
        spec = load_spec(None, [*DESIGN, f"shell.edges={edges}"])
        write_record(self.export, design(spec), shells=False)
        simulate_run(self.export, process=PROCESS, seed=3, shell=True, out=folder / "run")
        simulate_run(self.export, perfect=True, shell=True, phases="dark", out=folder / "drawn")
        self.written = calibrate(
            folder / "run", self.export, process=PROCESS, out=folder / "calibration"
        )
        for name, run in (("truth", "run"), ("drawing", "drawn")):
            for camera in CAMERAS:
                (folder / name / camera).mkdir(parents=True)
                truth = folder / run / f"truth_{camera}.json"
                copy(truth, folder / name / camera / "machine.json")
        self.scene = prepared_scene(run_object(read_export(self.export), None))

    def quality(self, calibration: str) -> float:
        """Mean SSIM of views of the photographs merged by a machine."""
        run, out = self.folder / "run", self.folder / f"by-{calibration}"
        known, brightness = self.folder / calibration, 1 / OBJECT_LIGHT
        record = merge(run, known, self.export, out=out, brightness=brightness)
        assert set(record["based_on"]) == {*CAMERAS}
        assert not any(half["mirrors_missing"] for half in record["based_on"].values())
        return mean_ssim(MirrorTiles(LightField.read(out)), self.scene)


@pytest.fixture(scope="module", params=["valley", "pedestal"])
def loop(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> ShellLoop:
    return ShellLoop(tmp_path_factory.mktemp("shell"), request.param)


def test_each_camera_has_its_calibration(loop: ShellLoop) -> None:
    assert [one.folder.name for one in loop.written.every] == [*CAMERAS]
    for one in loop.written.every:
        assert one.verdict.answer != "not good"
        assert one.record["rays"]["mirrors_without_frame"] == []
        assert {name[0] for name in one.result.rays.ids} == {one.folder.name}


def test_the_calibration_tells_where_highlights_are(loop: ShellLoop) -> None:
    for camera in CAMERAS:
        truth, found, drawn = (
            read_machine(loop.folder / name / camera / "machine.json")[0]
            for name in ("truth", "calibration", "drawing")
        )
        counts = 1, len(truth.radius), len(truth.leds)
        places = [index.ravel() for index in np.indices(counts)]
        after, before = (
            np.median(norm(one.highlights(*places) - truth.highlights(*places)))
            for one in (found, drawn)
        )
        assert after < before / 10


def test_calibrated_photographs_give_the_views_of_the_true_machine(loop: ShellLoop) -> None:
    truth = loop.quality("truth")
    assert abs(loop.quality("calibration") - truth) < ALLOWED
    assert loop.quality("drawing") < truth - ALLOWED
