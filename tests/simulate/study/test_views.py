"""Studies of views: SSIM by sensor, and the prototype against the shell."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ttest_rel

from tbcad.cli import run
from tbcad.errors import InputError
from tbcad.mirrors.array import design
from tbcad.simulate.scene.exported import read_export
from tbcad.simulate.scene.object import built_in_object
from tbcad.simulate.study.pixels import Sensor
from tbcad.simulate.study.prototype_vs_shell import paired_difference, prototype_vs_shell
from tbcad.simulate.study.ssim import SensorCase, sensor_cases, ssim
from tbcad.simulate.study.study import Study, study_files
from tbcad.simulate.study.viewpoints import viewpoints_around
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec

SMALL = ["n=6", "camera.width_px=208", "camera.height_px=155"]
SENSORS = (Sensor(208, 155), Sensor(416, 310), Sensor(832, 620))


def quiet(_: str) -> None:
    pass


def test_every_sensor_has_its_own_n() -> None:
    """Four times the sides: sixteen times the pixels, twice the n (designs/sensor-10mp.toml)."""
    found = sensor_cases(
        load_spec(None), (Sensor(2080, 1552), Sensor(8320, 6208), Sensor(3664, 2748))
    )
    assert [case.n for case in found] == [18, 36, 24]
    assert sensor_cases(load_spec(None, SMALL), (Sensor(16, 16),)) == (
        SensorCase(Sensor(16, 16), 2),
    )


@pytest.fixture(scope="module")
def study() -> Study:
    places = viewpoints_around((15.0, 60.0), 2, 640.0)
    return ssim(load_spec(None, SMALL), built_in_object(60.0), SENSORS, places, "nearest", quiet)


def test_more_pixels_make_better_views(study: Study) -> None:
    means = study.tables[1]
    every = [row[6] for row in means.rows if row[3] == "all"]
    assert len(every) == 3
    assert every[0] < every[1] < every[2] < 1


def test_means_are_those_of_the_views(study: Study) -> None:
    views, means = study.tables[:2]
    assert len(views.rows) == 3 * 4
    mine = [row for row in views.rows if row[0] == 416 and row[3] == 60.0]
    (mean,) = [row for row in means.rows if row[0] == 416 and row[3] == 60.0]
    assert mean[4] == len(mine) == 2
    assert mean[6] == pytest.approx(np.mean([row[6] for row in mine]))


def test_fit_is_that_of_the_means(study: Study) -> None:
    means, fits = study.tables[1:]
    rows = [row for row in means.rows if row[3] == "all"]
    x = np.log10([row[0] * row[1] for row in rows])
    y = np.array([row[6] for row in rows])
    slope, intercept = np.polyfit(x, y, 1)
    (fit,) = [row for row in fits.rows if row[0] == "all"]
    assert fit[2:4] == pytest.approx((slope, intercept))
    rest = y - slope * x - intercept
    assert fit[4] == pytest.approx(1 - (rest**2).sum() / ((y - y.mean()) ** 2).sum())


def test_the_same_study_gives_the_same_files(study: Study) -> None:
    files = study_files(study)
    assert {"ssim.csv", "ssim-means.csv", "ssim-fits.csv", "ssim.png"} <= set(files)
    assert study_files(study) == files


def test_a_sensor_whose_mirrors_cannot_be_made_has_a_reason() -> None:
    hopeless = ["camera_mm=[174, 24, -243]", "semi_minor_mm=78", "capture_diameter_mm=36"]
    spec = load_spec(None, [*SMALL, "n=9", *hopeless])
    places = viewpoints_around((30.0,), 1, 640.0)
    with pytest.raises(SpecError) as refusal:
        design(spec)
    found = ssim(spec, built_in_object(36.0), SENSORS[:1], places, "nearest", quiet)
    assert [row[-1] for row in found.tables[0].rows] == [str(refusal.value)]
    assert found.summary.rows == ()


def test_paired_interval_is_students() -> None:
    rng = np.random.default_rng(3)
    one = rng.normal(0.9, 0.05, 20)
    other = one + rng.normal(0.01, 0.01, 20)
    found = paired_difference(one, other)
    low, high = ttest_rel(other, one).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((low, high))
    assert found.significant == bool(ttest_rel(other, one).pvalue < 0.05)
    assert not paired_difference(one, one[::-1]).significant


def test_prototype_against_the_shell(written: Path) -> None:
    """Fewer pixels and other virtual cameras: views that are a little worse, not other ones."""
    export = read_export(written)
    places = viewpoints_around((20.0, 60.0), 2, 640.0)
    found = prototype_vs_shell(export, built_in_object(60.0), places, "nearest", 2)
    rows = {row[0]: row[2] for row in found.summary.rows}
    shell, balls = (rows[f"mean SSIM of the {name}'s views"] for name in ("shell", "prototype"))
    assert 0.5 < balls < shell < 1
    assert rows["difference"] == pytest.approx(balls - shell)
    (table,) = found.tables
    assert len(table.rows) == 4
    assert [row[6] for row in table.rows] == pytest.approx([row[5] - row[4] for row in table.rows])


def test_viewpoints_all_round() -> None:
    places = viewpoints_around((0.0, 45.0), 4, 500.0)
    assert places.azimuth_deg.tolist() == [0, 90, 180, 270] * 2
    at = np.array([view.pinhole for view in places.views(60.0)])
    assert np.linalg.norm(at, axis=1) == pytest.approx(np.full(8, 500.0))
    assert at[4:, 2] == pytest.approx(np.full(4, 500 * np.sqrt(0.5)))
    with pytest.raises(InputError, match="--azimuths 0"):
        viewpoints_around((0.0,), 0, 500.0)


def test_bad_input_of_the_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (
        ["ssim", "--sensor", "abc"],
        ["ssim", "--azimuths", "0"],
        ["ssim", "--distance", "5"],
        ["prototype", str(tmp_path)],
    ):
        assert run(["study", *arguments, "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr().err.splitlines()
        assert said[-1].startswith("tbcad: ")
    assert not (tmp_path / "out").exists()
