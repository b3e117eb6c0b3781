"""The whole loop: photographs of a random build, its calibration, their merge, and views."""

from pathlib import Path
from shutil import copy

import numpy as np
import pytest

from tbcad.app.api import build, calibrate, merge, simulate_run
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.rig.machine.machine import read_machine
from tbcad.rig.simulated_run.photographs import OBJECT_LIGHT
from tbcad.rig.simulated_run.simulate import run_object
from tests.view_quality import mean_ssim

pytestmark = pytest.mark.slow

LOST = "a_0007_lit"
ALLOWED = 0.01  # of SSIM, between a calibrated and a perfect machine


class Loop:
    """Two runs of one export: of a random build, and of a perfect one."""

    def __init__(self, export: Path, folder: Path) -> None:
        self.export, self.folder = export, folder
        simulate_run(export, seed=3, out=folder / "run")
        simulate_run(export, perfect=True, out=folder / "perfect")
        calibrate(folder / "run", export, out=folder / "calibration")
        for name, run in (("truth", "run"), ("drawing", "perfect")):
            (folder / name).mkdir()
            copy(folder / run / "truth.json", folder / name / "machine.json")
        subject = run_object(read_export(export), None)
        self.scene = prepared_scene(subject)

    def quality(self, run: str, calibration: str) -> float:
        """Mean SSIM of the views of a run merged by a machine."""
        out = self.folder / f"{run}-{calibration}"
        merge(
            self.folder / run,
            self.folder / calibration,
            self.export,
            out=out,
            brightness=1 / OBJECT_LIGHT,
        )
        return mean_ssim(MirrorTiles(LightField.read(out)), self.scene)


@pytest.fixture(scope="module")
def loop(low_resolution_design: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Loop:
    folder = tmp_path_factory.mktemp("loop")
    build(low_resolution_design.spec, folder / "exports", parts=["prototype"], verify=False)
    return Loop(folder / "exports", folder)


def test_calibrated_photographs_give_the_views_of_a_perfect_machine(loop: Loop) -> None:
    perfect = loop.quality("perfect", "drawing")
    assert abs(loop.quality("run", "calibration") - perfect) < ALLOWED
    assert abs(loop.quality("run", "truth") - perfect) < ALLOWED
    assert loop.quality("run", "drawing") < perfect - 2 * ALLOWED


def test_the_calibration_finds_the_balls(loop: Loop) -> None:
    found, frames = read_machine(loop.folder / "calibration" / "machine.json")
    truth, expected = read_machine(loop.folder / "truth" / "machine.json")
    drawing, _ = read_machine(loop.folder / "drawing" / "machine.json")
    assert frames == expected
    before = np.linalg.norm(drawing.centre - truth.centre, axis=1)
    after = np.linalg.norm(found.centre - truth.centre, axis=1)
    assert np.median(after) < np.median(before)


def test_the_merge_finds_the_export_by_itself_and_names_what_is_lost(loop: Loop) -> None:
    photographs = loop.folder / "run" / "photographs"
    kept = (photographs / f"{LOST}.png").read_bytes()
    (photographs / f"{LOST}.png").write_bytes(kept[:1000])
    record = merge(loop.folder / "run", loop.folder / "calibration", out=loop.folder / "less")
    (photographs / f"{LOST}.png").write_bytes(kept)
    assert list(record["based_on"]["a"]["photographs_not_used"]) == [LOST]
    assert record["based_on"]["a"]["mirrors_missing"]
    assert not record["based_on"]["b"]["mirrors_missing"]
