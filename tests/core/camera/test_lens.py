"""The thin lens, against rays through its rim and known figures."""

import math

import numpy as np
import pytest

from tbcad.core.camera.requirements import (
    DepthRange,
    Lens,
    aperture_stop,
    aperture_stops,
    blur_limited,
    focal_length,
    lens_for,
    sharpest,
)
from tbcad.errors import InputError
from tbcad.studies.depth_of_field import LensOptions

LENS = Lens(pixel=0.00345, image=3.65, wide_open=2.8, wavelength=550e-6)
RANGE = DepthRange(150.0, 250.0)


def spot(lens: Lens, over: DepthRange, depth: float, pupil: float, across: float) -> float:
    """Width on the sensor of rays from a point off the axis through both ends of the pupil."""
    f, hits = focal_length(lens, over), []
    for height in (-pupil / 2, pupil / 2):
        slope = (height - across) / depth
        bent = slope - height / f  # what a thin lens does to a slope
        hits.append(height + bent * lens.image)
    return abs(hits[1] - hits[0])


@pytest.mark.parametrize("across", [0.0, 120.0])
@pytest.mark.parametrize("depth", [150.0, 250.0])
def test_blur_is_that_of_rays_through_the_rim(depth: float, across: float) -> None:
    """The same at both ends of the range, on the axis and off it."""
    pupil = blur_limited(LENS, RANGE, 1.0)
    blur = spot(LENS, RANGE, depth, pupil, across) / LENS.pixel
    assert blur == pytest.approx(1.0, rel=1e-9)
    assert aperture_stop(LENS, RANGE, pupil)["blur_px"] == pytest.approx(blur, rel=1e-9)


def test_focus_is_sharp() -> None:
    assert spot(LENS, RANGE, RANGE.focus, 1.0, 50.0) == pytest.approx(0, abs=1e-12)
    assert RANGE.focus == pytest.approx(187.5, rel=1e-15)


def test_angle_of_view() -> None:
    """Half the sensor's width is seen under half the angle."""
    lens = lens_for(math.radians(89), 2080, 0.00345, 2.8)
    half_width = 2080 * 0.00345 / 2
    assert math.degrees(math.atan(half_width / lens.image)) == pytest.approx(44.5, rel=1e-12)


def test_airy_disc_of_a_known_stop() -> None:
    """F/8 far away at 550 nm: 2.44 * 0.55 um * 8 = 10.736 um."""
    lens = Lens(pixel=0.001, image=50.0, wide_open=1.0, wavelength=550e-6)
    found = aperture_stop(lens, DepthRange(1e9, 2e9), 50.0 / 8)
    assert found["f_number"] == pytest.approx(8, rel=1e-6)
    assert found["airy_px"] == pytest.approx(10.736, rel=1e-6)


def test_sharpest_stop_has_the_smallest_blur() -> None:
    best = aperture_stop(LENS, RANGE, sharpest(LENS, RANGE))
    pupils = np.linspace(0.1, 1.2, 2000)
    least = min(aperture_stop(LENS, RANGE, pupil)["total_px"] for pupil in pupils)
    assert best["total_px"] <= least
    assert best["total_px"] == pytest.approx(least, rel=1e-5)
    assert best["blur_px"] == pytest.approx(best["airy_px"], rel=1e-12)


def test_light_is_the_square_of_the_f_numbers() -> None:
    found = aperture_stops(LENS, RANGE, 1.0)
    assert found["wide open"]["light"] == pytest.approx(1, rel=1e-12)
    assert found["wide open"]["f_number"] == pytest.approx(2.8, rel=1e-12)
    limited = found["blur limited"]
    assert limited["light"] == pytest.approx((2.8 / limited["f_number"]) ** 2, rel=1e-12)
    assert limited["stops_lost"] == pytest.approx(
        2 * math.log2(limited["f_number"] / 2.8), rel=1e-12
    )


def test_no_stop_is_wider_than_wide_open() -> None:
    """A shallow range would allow any pupil."""
    found = aperture_stops(LENS, DepthRange(200.0, 200.1), 1.0)
    assert found["blur limited"]["f_number"] == pytest.approx(2.8, rel=1e-12)
    assert found["sharpest"]["light"] == pytest.approx(1, rel=1e-12)
    assert found["blur limited"]["blur_px"] < 1


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["blur_px", "pixel_um", "wide_open"])
def test_options_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"--{name.replace('_', '-')}"):
        LensOptions(**{name: value}).checked()
