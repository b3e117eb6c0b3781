"""The whole loop: photographs of a random build, its calibration, their merge, and views."""

from pathlib import Path
from shutil import copy

import numpy as np
import pytest

from tbcad.app.api import build, calibrate, merge, simulate_run
from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.rig.machine.machine import Machine, read_machine
from tbcad.rig.simulated_run.photographs import OBJECT_LIGHT
from tbcad.rig.simulated_run.simulate import run_object
from tests.view_quality import mean_ssim

pytestmark = pytest.mark.slow

LOST = "a_0007_lit"
ALLOWED = 0.01  # of SSIM, between a calibrated and a perfect machine
SHELL = ("n=5", "camera.width_px=832", "camera.height_px=620")


class Loop:
    """Two runs of an export, of a random build and of a perfect one, and their machines.

    Of a prototype, or of both cameras of a shell.
    """

    def __init__(self, folder: Path, cameras: tuple[str, ...] = ()) -> None:
        self.folder, self.export, self.cameras = folder, folder / "exports", cameras
        shell, phases = bool(cameras), "dark" if cameras else None
        simulate_run(self.export, seed=3, shell=shell, out=folder / "run")
        simulate_run(self.export, perfect=True, shell=shell, phases=phases, out=folder / "perfect")
        self.written = calibrate(folder / "run", self.export, out=folder / "calibration")
        for name, run in (("truth", "run"), ("drawing", "perfect")):
            for place, file in self.machines("truth").items():
                (folder / name / place).mkdir(parents=True)
                copy(folder / run / file, folder / name / place / "machine.json")
        self.scene = prepared_scene(run_object(read_export(self.export), None))

    def machines(self, name: str) -> dict[str, str]:
        """Files of machines by their folders within one of a calibration."""
        return {camera: f"{name}_{camera}.json" for camera in self.cameras} or {"": f"{name}.json"}

    def machine(self, calibration: str, place: str = "") -> Machine:
        """One that was found, or is known."""
        return read_machine(self.folder / calibration / place / "machine.json")[0]

    def quality(self, run: str, calibration: str) -> float:
        """Mean SSIM of the views of a run merged by a machine."""
        out, known = self.folder / f"{run}-{calibration}", self.folder / calibration
        record = merge(self.folder / run, known, self.export, out=out, brightness=1 / OBJECT_LIGHT)
        if self.cameras:
            assert {*record["based_on"]} == {*self.cameras}
            assert not any(half["mirrors_missing"] for half in record["based_on"].values())
        return mean_ssim(MirrorTiles(LightField.read(out)), self.scene)


@pytest.fixture(scope="module")
def loop(low_resolution_design: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Loop:
    folder, spec = tmp_path_factory.mktemp("loop"), low_resolution_design.spec
    prototype = spec.prototype.model_copy(update={"ball_margin_mm": 0.0})
    spec = spec.model_copy(update={"prototype": prototype})
    build(spec, folder / "exports", parts=["prototype"], verify=False)
    return Loop(folder)


@pytest.fixture(scope="module")
def shells(tmp_path_factory: pytest.TempPathFactory) -> Loop:
    """On valleys; what grooves change in photographs is in tests/rig/machine/test_shells.py."""
    folder = tmp_path_factory.mktemp("shell")
    (folder / "exports").mkdir()
    write_record(folder / "exports", design(load_spec(None, list(SHELL))), shells=False)
    return Loop(folder, ("a", "b"))


def test_calibrated_photographs_give_the_views_of_a_perfect_machine(loop: Loop) -> None:
    """Weight puts balls elsewhere, so their views may be better than those of the perfect one."""
    perfect, truth = loop.quality("perfect", "drawing"), loop.quality("run", "truth")
    assert abs(loop.quality("run", "calibration") - truth) < ALLOWED
    assert truth > perfect - ALLOWED
    assert loop.quality("run", "drawing") < truth - 2 * ALLOWED


def test_calibrated_photographs_of_shells_give_the_views_of_the_true_machine(shells: Loop) -> None:
    truth = shells.quality("run", "truth")
    assert abs(shells.quality("run", "calibration") - truth) < ALLOWED
    assert shells.quality("run", "drawing") < truth - ALLOWED


def test_the_calibration_finds_the_balls(loop: Loop) -> None:
    found, truth, drawing = map(loop.machine, ("calibration", "truth", "drawing"))
    before, after = (norm(one.centre - truth.centre) for one in (drawing, found))
    assert np.median(after) < np.median(before)


def test_each_camera_of_a_shell_has_its_calibration_and_its_highlights(shells: Loop) -> None:
    assert [one.folder.name for one in shells.written.every] == [*shells.cameras]
    for one in shells.written.every:
        camera = one.folder.name
        assert one.verdict.answer != "not good"
        assert one.record["rays"]["mirrors_without_frame"] == []
        assert {name[0] for name in one.result.rays.ids} == {camera}
        truth, *others = (shells.machine(of, camera) for of in ("truth", "calibration", "drawing"))
        counts = 1, len(truth.radius), len(truth.leds)
        places = [index.ravel() for index in np.indices(counts)]
        lit = truth.highlights(*places)
        after, before = (np.median(norm(one.highlights(*places) - lit)) for one in others)
        assert after < before / 10


def test_the_merge_finds_the_export_by_itself_and_names_what_is_lost(loop: Loop) -> None:
    photographs = loop.folder / "run" / "photographs"
    kept = (photographs / f"{LOST}.png").read_bytes()
    (photographs / f"{LOST}.png").write_bytes(kept[:1000])
    record = merge(loop.folder / "run", loop.folder / "calibration", out=loop.folder / "less")
    (photographs / f"{LOST}.png").write_bytes(kept)
    assert list(record["based_on"]["a"]["photographs_not_used"]) == [LOST]
    assert record["based_on"]["a"]["mirrors_missing"]
    assert not record["based_on"]["b"]["mirrors_missing"]
