"""Cameras with lenses held against requirements."""

from dataclasses import replace
from pathlib import Path

import pytest

from tbcad.core.camera.requirements import CameraRequirements
from tbcad.core.camera.sheet import (
    CAMERA_COLUMNS,
    LENS_COLUMNS,
    CameraBody,
    RectilinearLens,
    candidates,
    load_cameras,
    load_lenses,
)
from tbcad.errors import InputError

NEEDED = CameraRequirements(90.0, 70.0, 2000, 1400, 100.0, 150.0, 120.0, 0.8, 2.0, 2.0, 2.8)
BODY = CameraBody("body", "M", 36.0, 27.0, 6000, 4500, "gphoto2", "test")
LENS = RectilinearLens("lens", ("M",), 10, 30, 2.8, 40, 100.0, 60.0, "test")


def only(body: CameraBody = BODY, lens: RectilinearLens = LENS, needed=NEEDED):
    (one,) = candidates(needed, [body], [lens])
    return one


def test_the_longest_focal_length_that_shows_all() -> None:
    """18 mm from lens to sensor shows 90 degrees on 36 mm: 1/f = 1/18 + 1/120."""
    one = only()
    assert one.focal_mm == pytest.approx(1 / (1 / 18 + 1 / 120))
    assert one.pixels_across == pytest.approx(6000)
    assert one.magnification == pytest.approx(18 / 120)
    assert one.f_number == pytest.approx(one.focal_mm / 0.8)
    assert one.faults == ()
    assert one.close_up_dpt == 0


@pytest.mark.parametrize(
    ("lens", "body", "fault"),
    [
        (replace(LENS, focal_min_mm=20), BODY, "of 90.0 degrees at 20 mm"),
        (replace(LENS, image_circle_mm=40), BODY, "image circle 40 of 43.9 mm"),
        (LENS, replace(BODY, width_px=1500), "1500 of 2000 pixels across the mirrors"),
        (replace(LENS, f_number_max=4), BODY, "F/4 blurs by"),
    ],
)
def test_each_fault_is_named(lens: RectilinearLens, body: CameraBody, fault: str) -> None:
    assert any(fault in text for text in only(body, lens).faults)


def test_a_close_up_lens_brings_the_nearest_focus_to_where_it_is_needed() -> None:
    """A thin lens that focuses from 250 mm of the sensor, with the power added, at 120 mm."""
    one = only(lens=replace(LENS, min_focus_mm=250))
    f = one.focal_mm
    s = 250 / 2 + (250**2 / 4 - f * 250) ** 0.5
    assert s + s * f / (s - f) == pytest.approx(250)
    assert one.close_up_dpt == pytest.approx(1000 / 120 - 1000 / s)


def test_those_without_faults_come_first() -> None:
    poor = replace(BODY, name="poor", width_px=1000)
    close = replace(LENS, name="close-up", min_focus_mm=200)
    first, second, *_ = candidates(NEEDED, [poor, BODY], [close, LENS])
    assert (first.camera, first.lens) == (BODY, LENS)
    assert (second.camera, second.lens) == (BODY, close)


def test_built_in_lists_are_sound() -> None:
    for body in load_cameras():
        height = body.height_px * body.pixel_mm
        assert height == pytest.approx(body.height_mm, rel=0.01)
    mounts = {body.mount for body in load_cameras()}
    assert all(any(lens.fits(mount) for mount in mounts) for lens in load_lenses())


@pytest.mark.parametrize(
    ("table", "text", "message"),
    [
        ("cameras", "x,M,36,24,6000,4000,gphoto2,", "line 2, column source: empty"),
        ("cameras", "x,M,0,24,6000,4000,gphoto2,s", "column sensor_width_mm: '0', allowed is a"),
        ("cameras", "Canon EOS R5,M,36,24,6000,4000,g,s", "column name: 'Canon EOS R5' twice"),
        ("lenses", "x,M,20,15,2.8,22,0.2,43,s", "column focal_max_mm: 15, allowed is 20 or more"),
        ("lenses", "x,M,20", "3 columns, not 9"),
    ],
)
def test_users_lists_are_refused_by_line(
    tmp_path: Path, table: str, text: str, message: str
) -> None:
    file = tmp_path / "mine.csv"
    columns, load = {
        "cameras": (CAMERA_COLUMNS, load_cameras),
        "lenses": (LENS_COLUMNS, load_lenses),
    }[table]
    file.write_text(",".join(columns) + "\n" + text + "\n")
    with pytest.raises(InputError, match=r"mine\.csv, line 2") as caught:
        load(file)
    assert message in str(caught.value)
