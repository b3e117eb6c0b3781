"""What the studies find and write; pixels and their balance against closed forms."""

import csv
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.common import schedule
from tbcad.common.results import (
    SUMMARY_COLUMNS,
    Study,
    Table,
    csv_text,
    study_files,
    write_study,
)
from tbcad.core.mirrors import radii
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import FIT
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.light.simulate import parallel
from tbcad.light.simulate.capture.photograph import (
    Sensor,
    count_pixels,
    parse_sensor,
    traced_pixels,
)
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.reflector import Reflector, reflectors
from tbcad.light.simulate.views.viewpoints import BY_NEAREST, viewpoints_around
from tbcad.output.single_files import check_tables
from tbcad.studies.depth_of_field import LensOptions, depth_of_field
from tbcad.studies.elevation import capture_area, elevation
from tbcad.studies.paper import is_table_i, with_lens_of_table_i
from tbcad.studies.resolution import COUNTED, KINDS, Ratio, balance, parse_ratio, resolution
from tbcad.studies.ssim import ssim
from tests.mirror_arrays import mirror_array, mirror_design

SMALL = ("n=4", "width_px=208", "height_px=155")
# No radius gives some of these mirrors their coverage.
HOPELESS = (*SMALL, "n=9", "camera_mm=[174, 24, -243]", "semi_minor_mm=78",
            "capture_diameter_mm=36")  # fmt: skip


@pytest.fixture(scope="module")
def small() -> Study:
    return small_resolution(range(3, 8), Sensor(208, 155), Sensor(416, 310))


def small_resolution(n: range, *sensors: Sensor) -> Study:
    return resolution(load_spec(None, SMALL), n, sensors, (Ratio(1, 1), Ratio(1, 4)))


def test_resolution_finds_what_its_rows_say(small: Study) -> None:
    swept, balanced = small.tables
    assert len(swept.rows) == 10
    for at in swept.records():
        assert at["virtual_cameras"] == 5 * at["n"] ** 2 + 2 * at["n"] + 1
        assert at["seeing_average_px"] == at["seeing_px"] / at["virtual_cameras"]
        assert at["seeing_px"] < at["on_mirrors_px"] < 2 * at["width_px"] * at["height_px"]
        assert 0 < at["resolved_average_spots"] < at["seeing_average_px"]
        assert at["ideal_spot_mm"] < at["real_spot_mm"]
    for at in balanced.records():
        if at["balanced_n"] is None:
            assert "--from" in at["reason"]
            continue
        aim = {"1:1": 1, "1:4": 0.25}[at["ratio"]]
        found = swept.where(width_px=at["width_px"])
        column = KINDS[str(at["pixels_counted"])]
        actual = found.numbers("virtual_cameras") / found.numbers(column)
        above, below = (found.numbers("n")[side] for side in (actual > aim, actual < aim))
        assert max(below) < at["balanced_n"] < min(above)
    assert np.isfinite(balanced.numbers("balanced_n")).any()
    assert not any("apex" in one.quantity for one in small.figures)  # has no such sensors


def test_any_number_of_threads_gives_the_same_files(monkeypatch: pytest.MonkeyPatch) -> None:
    files = study_files(small_resolution(range(3, 5), Sensor(208, 155)))
    monkeypatch.setattr(parallel, "THREADS", 1)
    monkeypatch.setattr(schedule, "cores", lambda: 1)
    assert study_files(small_resolution(range(3, 5), Sensor(208, 155))) == files
    assert len(files) == 5


def test_capture_area_has_the_paper_beside_it() -> None:
    table = (study := capture_area(load_spec(None), range(2, 6))).tables[0]
    (at,) = table.where(n=4).records()
    assert at["paper_claim_flat_mm"] == 21.2
    assert at["flat_closed_form_mm"] == pytest.approx(21.0, abs=0.01)  # measured before: 21.0
    array = mirror_array("n=4", "radius_rule=paper")
    assert at["paper_minimum_mm"] == array.coverage.min()
    assert at["paper_mirrors_short"] == (array.coverage < 59.9994).sum() > 0
    assert at["traced_minimum_mm"] > 60.59
    assert at["traced_mirrors_short"] == 0
    assert table.column("paper_claim_flat_mm") == [None, None, 21.2, None]
    assert study.summary.columns == SUMMARY_COLUMNS
    assert (study.figures[0].value, study.figures[0].paper) == (at["flat_closed_form_mm"], 21.2)


def test_a_refused_design_is_a_row_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(radii, "MAX_ITERATIONS", 2)  # else the search takes ten seconds
    spec, around = load_spec(None, HOPELESS), viewpoints_around((30.0,), 1, 640.0)
    (at,) = capture_area(spec, range(9, 10)).tables[0].records()
    assert at["traced_minimum_mm"] is None
    assert "no radius gives" in str(at["traced_reason"])
    study = resolution(spec, range(9, 10), (Sensor(208, 155),), (Ratio(1, 1),))
    (at,) = study.tables[0].records()
    assert [at[name] for name in COUNTED] == [None] * len(COUNTED)
    assert "no radius gives" in str(at["reason"])
    assert len(study_files(study)) == 5
    found = ssim(spec, built_in_object(36.0), (Sensor(208, 155),), around, BY_NEAREST, print)
    assert "no radius gives" in str(found.tables[0].column("reason"))
    assert found.figures == ()


def test_elevation_of_the_paper_design() -> None:
    """Radii by eq. 2 at n = 18: 8.00 ... 65.4 mm (DESIGN.md section 3), tied to the polar angle."""
    study = elevation(load_spec(None))
    mirrors, bands, correlated = study.tables
    assert len(mirrors.rows) == 847
    radius, polar = mirrors.numbers("paper_radius_mm"), np.array(mirrors.numbers("polar_deg"))
    assert min(radius) == pytest.approx(8.00, abs=0.005)
    assert max(radius) == pytest.approx(65.4, abs=0.06)
    assert (polar.min(), polar.max()) == (pytest.approx(45), pytest.approx(135))
    for row in correlated.where(of="log radius").records():
        assert (abs(row["correlation"]) > 0.97) == (row["with"] == "polar angle"), row["radii"]
    assert bands.numbers("mirrors").sum() == 847
    assert (np.diff(bands.numbers("elevation_from_deg")) == 15).all()
    low = (mirrors.numbers("elevation_deg") >= 15) & (mirrors.numbers("elevation_deg") < 30)
    mean = mirrors.numbers("seeing_px")[low].mean()
    assert bands.where(elevation_from_deg=15.0).numbers("mean_seeing_px")[0] == pytest.approx(mean)


def test_depth_of_flat_mirrors_and_the_paper_range(monkeypatch: pytest.MonkeyPatch) -> None:
    small = (Sensor(208, 155),)  # as good as four of up to 8320 x 6208
    monkeypatch.setattr("tbcad.studies.depth_of_field.default_sensors", lambda _: small)
    study = depth_of_field(load_spec(None, ["n=4"]), LensOptions())
    (flat,) = study.summary.where(quantity="camera to farthest image, flat radii").records()
    assert flat["tbcad"] == pytest.approx(2 * math.sqrt(15000) + 30, rel=1e-12)
    assert (flat["paper"], flat["where"]) == (250, "section 6")
    paper = study.tables[1].where(range="the paper's distances")
    assert [row[1:4] for row in paper.rows] == [(150, 250, pytest.approx(187.5))] * 3
    # Closed form: with 2080 pixels across 89 degrees a pixel is 2 tan(44.5 deg) / 2080 wide at
    # unit distance, and pupil = 2 pixel / (1/150 - 1/250).
    assert (study.tables[2].numbers("best_pupil_mm") > 0).tolist() == [
        True
    ] * 3  # radii by each rule
    (limited,) = paper.where(stop="blur limited").records()
    width = 2 * math.tan(math.radians(44.5)) / 2080
    assert limited["pupil_mm"] == pytest.approx(2 * width / (1 / 150 - 1 / 250), rel=1e-12)


def test_csv_keeps_every_digit() -> None:
    table = Table("t", ("a", "b", "c"), ((1 / 3, None, "x, y"), (1e-17, 3, "")))
    rows = list(csv.reader(csv_text(table).splitlines()))
    assert rows[0] == ["a", "b", "c"]
    assert (float(rows[1][0]), rows[1][1:]) == (1 / 3, ["", "x, y"])
    assert float(rows[2][0]) == 1e-17
    assert table.numbers("b") == pytest.approx([math.nan, 3], nan_ok=True)


def test_only_its_own_files_are_replaced(tmp_path: Path) -> None:
    out = tmp_path / "new" / "studies"
    study = elevation(load_spec(None, ["n=4"]))
    files = write_study(study, out)
    (out / "mine.txt").write_text("mine")
    (out / "elevation.csv").write_text("old")
    assert write_study(study, out) == files
    assert {path.name for path in out.iterdir()} == {"mine.txt", *(path.name for path in files)}
    assert (out / "elevation.csv").read_bytes() == study_files(study)["elevation.csv"]
    with pytest.raises(InputError, match="is a file"):
        check_tables(out / "mine.txt" / "studies")
    check_tables(tmp_path / "not" / "yet")
    assert not (tmp_path / "not").exists()


def test_which_designs_are_the_papers() -> None:
    """The lens of Table I is for its geometry: elsewhere it would be too wide or too narrow."""
    for options, same, lens in (
        ([], True, 89),
        (["n=5", "radius_rule=flat", "width_px=100"], True, 89),
        (["hfov_deg=88"], False, 88),
        (["camera_mm=[130, 0, -220]"], False, FIT),
        (["semi_minor_mm=101"], False, FIT),
        (["capture_diameter_mm=59"], False, FIT),
    ):
        spec = load_spec(None, options)
        assert is_table_i(spec) == same
        assert with_lens_of_table_i(spec).camera.hfov_deg == lens


def test_command_writes_and_shows(tmp_path: Path, cli: Callable[..., Any]) -> None:
    out = tmp_path / "studies"
    shown = cli("study", "capture-area", "--from", "4", "--to", "4", "--out", out).out
    assert "21.2 mm" in shown
    assert "capture-area.csv" in shown
    assert (out / "capture-area.svg").stat().st_size > 10_000


# The paper's lens does not hold the few large mirrors of a small n.
WIDE = ("n=8", "hfov_deg=95", "width_px=832", "height_px=620")


@pytest.fixture(scope="module")
def wide() -> MirrorDesign:
    return mirror_design(*WIDE)


def window(at: Reflector, mirror: int) -> float:
    """Area of a mirror's cell in the picture, in pixels, from its arcs alone."""
    offsets, sides = at.cells.rings
    own, steps = sides[offsets[mirror] : offsets[mirror + 1]], np.linspace(0, 1, 200)
    t = np.where((own % 2 == 0)[:, None], steps, steps[::-1])
    point = at.cells.arcs.at(np.broadcast_to((own // 2)[:, None], t.shape), t)
    x, y = at.camera.project(point.reshape(-1, 3)).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def test_pixels_on_mirrors_are_the_areas_of_their_cells(wide: MirrorDesign) -> None:
    """Pixels counted one by one against the area within the cell's arcs."""
    at = reflectors(wide)[0]
    on = count_pixels(wide.arrays[0], Sensor(832, 620), 30.0).on
    area = np.array([window(at, i) for i in range(len(at))])
    assert np.abs(on - area).max() < 3 * np.sqrt(area.max())  # pixels along its edge
    assert on.sum() == pytest.approx(area.sum(), rel=5e-4)


def test_both_cameras_have_the_same_pixels(wide: MirrorDesign) -> None:
    theta0 = wide.arrays[0].theta0
    a, b = (traced_pixels(at, theta0, 30.0) for at in reflectors(wide))
    assert np.array_equal(a, b)


def test_no_ray_meets_nothing_and_all_meet_everything(wide: MirrorDesign) -> None:
    array = wide.arrays[0]
    sensor = Sensor(416, 310)
    assert count_pixels(array, sensor, 0.0).seen.sum() == 0
    most = count_pixels(array, sensor, 300.0)  # all mirrors are inside
    some = count_pixels(array, sensor, 30.0)
    assert (some.seen <= some.on).all()
    assert 0.3 < some.seen.sum() / some.on.sum() < 0.9
    assert np.array_equal(some.on, most.on)
    assert np.array_equal(most.seen, most.on)


@pytest.mark.parametrize("size", [(1664, 1240), (1663, 1239)])
def test_rays_for_blocks_of_pixels_give_the_same_count(
    wide: MirrorDesign, size: tuple[int, int]
) -> None:
    """Also where sides do not divide."""
    array, sensor = wide.arrays[0], Sensor(*size)
    every = count_pixels(array, sensor, 30.0)
    some = count_pixels(array, sensor, 30.0, most_rays=600_000)
    assert (every.rays, some.rays) == (size[0] * size[1], 832 * 620)
    assert some.on.sum() == pytest.approx(every.on.sum(), rel=5e-4)
    assert some.seen.sum() == pytest.approx(every.seen.sum(), rel=5e-4)


def test_balance_of_power_laws_is_exact() -> None:
    """5 n^2 cameras with 500,000 / n^2 pixels balance where n^4 = 100,000 ratio.

    Designs that were refused are passed over; outside the sweep there is none.
    """
    n = np.arange(5.0, 40.0)
    cameras, pixels = 5 * n**2, 5e5 / n**2
    cameras[12], pixels[12] = np.nan, np.nan
    for ratio in (Ratio(1, 1), Ratio(1, 4), Ratio(4, 1)):
        balanced, nearest = balance(n, cameras, pixels, ratio)
        assert balanced == pytest.approx((1e5 * ratio.cameras / ratio.pixels) ** 0.25, rel=1e-12)
        assert abs(n[nearest] - balanced) < 1
    assert np.isnan(balance(n[15:], cameras[15:], pixels[15:], Ratio(1, 1))[0])
    assert np.isnan(balance(n, n * np.nan, n * np.nan, Ratio(1, 1))[0])


@pytest.mark.parametrize("text", ["", "15x1552", "2080x99999", "-1x20", "nan:1", "1:inf", "a:b"])
def test_texts_refused(text: str) -> None:
    assert parse_sensor("8320x6208") == Sensor(8320, 6208)
    assert parse_ratio("1:4") == Ratio(1, 4)
    with pytest.raises(InputError, match="2080x1552"):
        parse_sensor(text)
    with pytest.raises(InputError, match="1:4"):
        parse_ratio(text)
