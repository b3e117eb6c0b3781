"""Studies of views: SSIM by sensor, and the prototype against the shell."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ttest_rel

from tbcad.common.results import Study, study_files
from tbcad.core.mirrors import radii
from tbcad.core.mirrors.array import design
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.light.simulate.capture.pixel_counts import Sensor
from tbcad.light.simulate.scene.exported import read_export
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.views.viewpoints import Viewpoints, viewpoints_around
from tbcad.studies.low_pass import BlurOptions, low_pass
from tbcad.studies.paper import balanced_sensors
from tbcad.studies.prototype_vs_shell import mean_difference_interval, prototype_vs_shell
from tbcad.studies.ssim import proportionate_n, sensor_n, ssim

SMALL = ["n=6", "camera.width_px=208", "camera.height_px=155"]
SENSORS = (Sensor(208, 155), Sensor(312, 232), Sensor(416, 310))


def quiet(_: str) -> None:
    pass


def test_sensors_of_table_ii_have_its_n() -> None:
    """Table II: 12, 18, 26 and 36; in proportion 1040 x 776 would have 13 and 4160 x 3104 25."""
    paper, other = load_spec(None), load_spec(None, ["n=17"])
    sensors = [Sensor(row.width_px, row.height_px) for row in balanced_sensors()]
    assert [sensor_n(paper, sensor) for sensor in sensors] == [12, 18, 26, 36]
    assert [proportionate_n(paper, sensor) for sensor in sensors] == [13, 18, 25, 36]
    assert [sensor_n(other, sensor) for sensor in sensors] == [12, 17, 24, 34]
    assert sensor_n(paper, Sensor(3664, 2748)) == 24


class SmallViews(Viewpoints):
    """With a quarter of the pixels: how blurred views are is searched for, which takes long."""

    def cameras(self, capture_mm: float, size: tuple[int, int] = (320, 240)) -> list[Camera]:
        return super().cameras(capture_mm, size)


@pytest.fixture(scope="module")
def study() -> Study:
    viewpoints = SmallViews(**vars(viewpoints_around((15.0, 60.0), 2, 640.0)))
    return ssim(
        load_spec(None, SMALL), built_in_object(60.0), SENSORS, viewpoints, "nearest", quiet
    )


def test_more_pixels_make_better_views(study: Study) -> None:
    means = study.tables[1]
    every = means.where(elevation_deg="all").numbers("ssim")
    assert len(every) == 3
    assert every[0] < every[1] < every[2] < 1


def test_more_pixels_make_sharper_views(study: Study) -> None:
    rows = study.tables[1].where(elevation_deg="all")
    blur, share = rows.numbers("blur_mm"), rows.numbers("object_share")
    assert blur[0] > blur[1] > blur[2] > 0
    assert len(np.unique(share)) == 1  # the same viewpoints
    assert 0.01 < share[0] < 0.8
    on_object, all_over = rows.numbers("ssim_on_object"), rows.numbers("ssim")
    assert (on_object < all_over).all()  # the background is even


def test_elevations_of_the_sharpest_and_most_similar_views(study: Study) -> None:
    means = study.tables[1].where(width_px=208)
    rows = {figure.quantity: figure for figure in study.figures}
    found = rows["208x155: elevation of the least blur"]
    at = {elevation: means.where(elevation_deg=elevation) for elevation in (15.0, 60.0)}
    blur = {elevation: row.numbers("blur_mm")[0] for elevation, row in at.items()}
    assert found.value == min(blur, key=lambda elevation: blur[elevation])
    assert (found.paper, found.where) == (15, "section 4.4")


def test_a_sensor_whose_mirrors_cannot_be_made_has_a_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(radii, "MAX_ITERATIONS", 2)  # else the search takes ten seconds
    hopeless = ["camera_mm=[174, 24, -243]", "semi_minor_mm=78", "capture_diameter_mm=36"]
    spec = load_spec(None, [*SMALL, "n=9", *hopeless])
    viewpoints = viewpoints_around((30.0,), 1, 640.0)
    with pytest.raises(SpecError) as refusal:
        design(spec)
    found = ssim(spec, built_in_object(36.0), SENSORS[:1], viewpoints, "nearest", quiet)
    assert found.tables[0].column("reason") == [str(refusal.value)]
    assert found.figures == ()


def test_interval_of_the_mean_difference() -> None:
    rng = np.random.default_rng(3)
    one = rng.normal(0.9, 0.05, 20)
    other = one + rng.normal(0.01, 0.01, 20)
    interval = mean_difference_interval(one, other)
    difference = other - one
    half = 2.093024 * difference.std(ddof=1) / np.sqrt(20)  # t at 97.5 %, 19 degrees of freedom
    assert interval == pytest.approx((difference.mean() - half, difference.mean() + half))
    low, high = mean_difference_interval(one, one[::-1])
    assert low < 0 < high
    assert mean_difference_interval(one[:1], other[:1]) == (-np.inf, np.inf)


@pytest.mark.slow
def test_prototype_against_the_shell(export_folder: Path) -> None:
    """Fewer pixels and other virtual cameras: views that are slightly worse."""
    export = read_export(export_folder)
    viewpoints = viewpoints_around((20.0, 60.0), 2, 640.0)
    found = prototype_vs_shell(export, built_in_object(60.0), viewpoints, "nearest", 2)
    rows = {figure.quantity: figure.value for figure in found.figures}
    shell, balls = (rows[f"mean SSIM of the {name}'s views"] for name in ("shell", "prototype"))
    assert 0.5 < balls < shell < 1
    assert rows["difference"] == pytest.approx(balls - shell)
    (table,) = found.tables
    assert len(table.rows) == 4
    ssim_of = {name: table.numbers(f"{name}_ssim") for name in ("shell", "prototype")}
    assert table.numbers("ssim_difference") == pytest.approx(
        ssim_of["prototype"] - ssim_of["shell"]
    )
    significant = ttest_rel(*ssim_of.values()).pvalue < 0.05
    verdict = "significant" if significant else "not significant"
    assert rows["at 95 % the difference is"] == verdict


@pytest.mark.slow
def test_low_pass_filter_blurs_the_views(export_folder: Path) -> None:
    """Section 5.3: the wider the filter, the lower the contrast, and the blurrier every view."""
    viewpoints = viewpoints_around((30.0,), 1, 640.0)
    options = BlurOptions((1.0, 3.0), (3.0,), 1)
    found = low_pass(read_export(export_folder), built_in_object(60.0), viewpoints, options)
    means = found.tables[1]
    assert len(found.tables[0].rows) == len(means.rows) == 5 * 2
    for view in ("pinhole", "aperture"):
        none, narrow, wide = (
            means.where(geometry="prototype", view=view, px=px, blur=blur).records()[0]
            for blur, px in (("none", 0.0), ("filter", 1.0), ("filter", 3.0))
        )
        assert 1 == none["photograph_contrast"] > narrow["photograph_contrast"]
        assert narrow["photograph_contrast"] > wide["photograph_contrast"] > 0.2
        assert none["blur_mm"] < narrow["blur_mm"] < wide["blur_mm"]
        assert none["ssim"] > wide["ssim"]
    (shell,) = means.where(geometry="shell", view="aperture").records()
    assert shell["blur_mm"] < none["blur_mm"]
    assert len(study_files(found)) == 5


def test_blurs_refused() -> None:
    with pytest.raises(InputError, match="--filter-px 0"):
        BlurOptions((0.0,)).checked()
    with pytest.raises(InputError, match="--lens-px nan"):
        BlurOptions(lens_px=(np.nan,)).checked()


def test_viewpoints_around_the_object() -> None:
    viewpoints = viewpoints_around((0.0, 45.0), 4, 500.0)
    assert viewpoints.azimuth_deg.tolist() == [0, 90, 180, 270] * 2
    at = np.array([view.pinhole for view in viewpoints.cameras(60.0)])
    assert np.linalg.norm(at, axis=1) == pytest.approx(np.full(8, 500.0))
    assert at[4:, 2] == pytest.approx(np.full(4, 500 * np.sqrt(0.5)))
    with pytest.raises(InputError, match="--azimuths 0"):
        viewpoints_around((0.0,), 0, 500.0)
