"""Studies of views: by sensor, by object, by blur, and the prototype against the shell."""

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from scipy.stats import ttest_rel

from tbcad.common.results import Study, study_files
from tbcad.core.camera.sheet import write_camera_sheet
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.capture.photograph import Sensor
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.scene.object import built_in_object, patterned_ball
from tbcad.light.simulate.scene.ray_casting import LAMPS, cast_rays, prepared_scene
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.light.simulate.views.viewpoints import (
    BY_NEAREST,
    Viewpoints,
    viewpoints_around,
    viewpoints_over_hemisphere,
)
from tbcad.records.tables import BallRow
from tbcad.studies.balance import balance
from tbcad.studies.low_pass import BlurOptions, low_pass
from tbcad.studies.paper import balanced_sensors
from tbcad.studies.ssim import (
    mean_difference_interval,
    proportionate_n,
    prototype_vs_shell,
    sensor_n,
    ssim,
)

SMALL = ["n=6", "camera.width_px=208", "camera.height_px=155"]
SENSORS = (Sensor(208, 155), Sensor(312, 232), Sensor(416, 310))


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
    viewpoints = SmallViews(**vars(viewpoints_around((15.0, 60.0), 1, 640.0)))
    return ssim(load_spec(None, SMALL), built_in_object(60.0), SENSORS, viewpoints, BY_NEAREST)


def test_more_pixels_make_better_and_sharper_views(study: Study) -> None:
    rows = study.tables[1].where(elevation_deg="all")
    every, blur, share = (rows.numbers(name) for name in ("ssim", "blur_mm", "object_share"))
    assert every[0] < every[1] < every[2] < 1
    assert blur[0] > blur[1] > blur[2] > 0
    assert len(np.unique(share)) == 1  # the same viewpoints
    assert 0.01 < share[0] < 0.8
    assert (rows.numbers("ssim_on_object") < every).all()  # the background is even
    (found,) = (at for at in study.figures if at.quantity == "208x155: elevation of the least blur")
    low, high = (
        study.tables[1].where(width_px=208, elevation_deg=elevation).numbers("blur_mm")[0]
        for elevation in (15.0, 60.0)
    )
    assert found.value == (15.0 if low < high else 60.0)
    assert (found.paper, found.where) == (15, "section 4.4")


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
    viewpoints = SmallViews(**vars(viewpoints_around((20.0, 60.0), 2, 640.0)))
    found = prototype_vs_shell(export, built_in_object(60.0), viewpoints, BY_NEAREST, 2)
    rows = {figure.quantity: figure.value for figure in found.figures}
    shell, balls = (rows[f"mean SSIM of the {name}'s views"] for name in ("shell", "prototype"))
    assert 0.5 < balls < shell < 1
    (table,) = found.tables
    assert len(table.rows) == 4
    assert rows["difference"] == pytest.approx(balls - shell)
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
    viewpoints = SmallViews(**vars(viewpoints_around((30.0,), 1, 640.0)))
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
        # It is found among the blurs of a list, so that two may be the same one.
        assert none["blur_mm"] < narrow["blur_mm"] <= wide["blur_mm"]
        assert none["ssim"] > wide["ssim"]
    (shell,) = means.where(geometry="shell", view="aperture").records()
    assert shell["blur_mm"] < none["blur_mm"]
    assert len(study_files(found)) == 5


@pytest.mark.slow
def test_real_optics_of_shell_and_prototype(
    export_folder: Path, low_resolution_design: MirrorDesign, tmp_path: Path
) -> None:
    """The lens blurs both, and a filter as well blurs more; the balls scatter as their grades."""
    folder = Path(copytree(export_folder, tmp_path / "build"))
    write_camera_sheet(folder, low_resolution_design.arrays[0], 30.0)
    export, knot = read_export(folder), built_in_object(60.0)
    viewpoints = SmallViews(**vars(viewpoints_around((30.0,), 1, 640.0)))
    ideal, real = (
        prototype_vs_shell(export, knot, viewpoints, BY_NEAREST, 1, optics=optics).tables[0]
        for optics in ("ideal", "real")
    )
    for name in ("shell_ssim", "prototype_ssim"):
        assert real.numbers(name).mean() < ideal.numbers(name).mean()
    shell, balls, narrow, wide = BlurOptions((1.0, 3.0)).real_cases(export)
    both = [one.samples for one in (shell, balls, narrow, wide)]
    assert all(isinstance(one, RealOptics) for one in both)
    assert [one.filter_px for one in both] == [0, 0, 1, 3]  # type: ignore[union-attr]
    assert len(both[1].roughness_nm) == len(BallRow.read(export_folder))  # type: ignore[union-attr]


def test_viewpoints_around_the_object() -> None:
    viewpoints = viewpoints_around((0.0, 45.0), 4, 500.0)
    assert viewpoints.azimuth_deg.tolist() == [0, 90, 180, 270] * 2
    at = np.array([view.pinhole for view in viewpoints.cameras(60.0)])
    assert np.linalg.norm(at, axis=1) == pytest.approx(np.full(8, 500.0))
    assert at[4:, 2] == pytest.approx(np.full(4, 500 * np.sqrt(0.5)))


@pytest.mark.slow
def test_balance_of_every_object_at_every_n() -> None:
    """A matt surface near the reference plane needs pixels, one far from it directions."""
    small = load_spec(None, ["camera.width_px=416", "camera.height_px=310"])
    table, best = balance(small, (4, 8), 3, 640.0, BY_NEAREST).tables
    assert len(table.rows) == 2 * 4
    assert table.column("virtual_cameras") == [89] * 4 + [337] * 4
    pixels = table.numbers("pixels")
    assert (pixels[:4] > 2 * pixels[4:]).all()
    assert ((table.numbers("ssim_on_object") > 0) & (table.numbers("ssim_on_object") < 1)).all()
    assert len(best.rows) == 4
    for row in best.records():
        own = table.where(surface=row["surface"], radius_mm=row["radius_mm"])
        assert row["ssim_on_object"] == own.numbers("ssim_on_object").max()
    rows = [table.where(surface="matt", n=n).numbers("ssim_on_object") for n in (4, 8)]
    gain = rows[1] - rows[0]
    assert gain[1] > gain[0]


def test_a_highlight_moves_with_the_viewpoint_and_is_where_light_is_mirrored() -> None:
    matt = prepared_scene(patterned_ball(20.0))
    glossy = replace(matt, gloss=1.0)
    rng = np.random.default_rng(1)
    toward = rng.normal(size=(4000, 3))
    toward[:, 2] = np.abs(toward[:, 2])
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    aim = rng.uniform(-10, 10, size=toward.shape)
    origin = aim + 200 * toward
    plain, glint = (cast_rays(scene, origin, -toward) for scene in (matt, glossy))
    assert np.array_equal(plain.depth, glint.depth)
    brighter = (glint.colour - plain.colour).max(axis=1) > 20
    normal = (origin - plain.depth[:, None] * toward) / 20
    half = [(toward + lamp) / np.linalg.norm(toward + lamp, axis=1)[:, None] for lamp in LAMPS]
    hit = np.isfinite(plain.depth)
    angle = np.min([np.arccos(np.clip((normal * h).sum(1), -1, 1)) for h in half], axis=0)
    assert 20 < brighter.sum() < hit.sum() / 2
    assert angle[hit & brighter].max() < np.radians(22)
    assert brighter[hit & (angle < np.radians(3)) & (plain.colour.min(axis=1) < 150)].all()


def test_viewpoints_are_even_over_the_hemisphere() -> None:
    """As many on each belt of equal area: of equal height (Archimedes)."""
    views = viewpoints_over_hemisphere(200, 640.0)
    height = np.sin(np.radians(views.elevation_deg))
    assert np.histogram(height, 10, (0, 1))[0].tolist() == [20] * 10
    quarter, _ = np.histogram(views.azimuth_deg, 4, (0, 360))
    assert np.ptp(quarter) <= 4
    assert np.abs(np.sin(2 * np.radians(views.azimuth_deg[:50]))).min() > 0.01
