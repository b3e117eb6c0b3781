"""A run whose photographs Mitsuba rendered, calibrated and merged: errors as large as stated.

Light and build are kept (`rendered/`); `mitsuba_run` made them. Carrier, gravity, forms of caps,
lens, pupil, LEDs and noise are drawn and placed by code that tbcad does not share.
"""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run
from tbcad.options.machines import CalibrateOptions
from tbcad.rig.calibration.run import WrittenCalibration, calibrate_run
from tests.clients.rendered_groups import groups, pooled, table
from tests.clients.rendered_photographs import STEP, develop
from tests.clients.rendered_rig import built

pytestmark = pytest.mark.clients

KEPT = Path(__file__).parent / "rendered"
LIGHT = KEPT / "light.npz"


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> WrittenCalibration:
    folder = tmp_path_factory.mktemp("rendered")
    shutil.copytree(KEPT / "build", folder / "build")
    develop(folder / "build", LIGHT, folder / "run")
    out = folder / "calibration"
    return calibrate_run(CalibrateOptions(run=folder / "run", exports=folder / "build", out=out))


def test_each_group_is_found_as_well_as_stated(calibrated: WrittenCalibration) -> None:
    with np.load(LIGHT) as kept:
        frames, seed = [tuple(one) for one in kept["frames"].tolist()], int(kept["seed"])
    found = groups(calibrated.result, built(KEPT / "build", frames, seed))
    assert len(found) == 15
    outside = {name: one for name, one in pooled(found).items() if not 0.5 <= one <= 2}
    assert not outside, table(found)


def test_a_view_of_the_merged_run_is_what_mitsuba_shows(
    calibrated: WrittenCalibration, tmp_path: Path
) -> None:
    run_folder = calibrated.folder.parent / "run"
    words = ["merge", str(run_folder), "--calibration", str(calibrated.folder)]
    assert run([*words, "--out", str(tmp_path / "merged")]) in (0, 1)
    shown = ["--azimuth", "20", "--elevation", "45", "--width", "320", "--height", "240"]
    file = tmp_path / "view.png"
    assert run(["view", str(tmp_path / "merged"), *shown, "--out", str(file)]) == 0
    with np.load(LIGHT) as kept:
        truth = STEP * kept["view"].astype(float)
    assert peak_ratio_db(np.asarray(Image.open(file).convert("RGB")) / 255, truth) > 20


def peak_ratio_db(picture: np.ndarray, truth: np.ndarray) -> float:
    """Peak signal to noise ratio, with the factor of the exposure that fits best."""
    factor = (picture * truth).sum() / (picture**2).sum()
    return float(-10 * np.log10(((factor * picture - truth) ** 2).mean() / truth.max() ** 2))
