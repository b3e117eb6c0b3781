"""Resolvable spots: closed forms, and which of the paper's figures hold before a real lens."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1

from tbcad.core.camera.requirements import virtual_images
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.lens import RAY_SHARE
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.capture.photograph import Sensor, count_pixels, virtual_cameras
from tbcad.studies.paper import try_design, with_lens_of_table_i
from tbcad.studies.resolution import pixel_pitch
from tbcad.studies.resolved import ResolvedSpots, passbands, spot_mm

USUAL, FINEST = Sensor(2080, 1552), Sensor(8320, 6208)


@cache
def of_n(n: int, sensor: Sensor) -> tuple[int, float, ResolvedSpots]:
    """Virtual cameras, pixels of one, and what a lens leaves of them."""
    array = try_design(with_lens_of_table_i(load_spec(None)), optics={"n": n}).array
    assert isinstance(array, MirrorArray)
    seen, cameras = count_pixels(array, sensor, 30.0).seen, virtual_cameras(array)
    real = ResolvedSpots(virtual_images(array, 30.0), seen, pixel_pitch(array.camera, sensor))
    return cameras, 2 * float(seen.sum()) / cameras, real


def average(n: int, sensor: Sensor) -> float:
    cameras, _, real = of_n(n, sensor)
    return 2 * float(real.spots.sum()) / cameras


def test_a_pixel_is_a_spot_and_an_even_circle_has_its_area() -> None:
    coarse, fine = (passbands(np.zeros(1), cutoff)[0, 0] for cutoff in (5.0, 20.0))
    assert coarse < fine < 1  # the Airy pattern's wide rings cost a pixel's spot the rest
    assert fine > 0.85
    disc = np.pi / 4 * (RAY_SHARE * 40) ** 2  # blur of 40 pixels; its edge is some pixels wide
    assert 1 / passbands(np.full(1, 40.0), 2.0) == pytest.approx(disc, rel=0.06)


def test_a_spot_by_diffraction_alone_has_the_area_of_the_airy_pattern() -> None:
    """By Parseval: the square of (2 J1(x) / x)^2 pi / 4 cutoff^2, x = pi cutoff r, over a plane."""
    cutoff = 0.1
    square = quad(lambda x: (2 * j1(x) / x) ** 4 * x, 1e-9, 200, limit=400)[0]
    exact = 2 * np.pi * square / (np.pi * cutoff) ** 2 * (np.pi / 4 * cutoff**2) ** 2
    assert passbands(np.zeros(1), cutoff)[0, 0] == pytest.approx(exact, rel=0.01)


def test_a_spot_fills_the_disc_that_is_seen() -> None:
    assert 1000 * spot_mm(60.0, 1000) ** 2 == pytest.approx(np.pi * 30.0**2)


def test_n_that_balances_is_less_before_a_lens() -> None:
    """18 with all pixels, 14 with resolvable spots; a sensor 16 times as fine brings two more."""
    cameras, pixels, _ = of_n(18, USUAL)
    assert 0.9 < pixels / cameras < 1 < cameras / average(18, USUAL) / 2
    assert of_n(13, USUAL)[0] < average(13, USUAL)
    assert of_n(14, USUAL)[0] > average(14, USUAL)
    assert of_n(16, FINEST)[0] < average(16, FINEST)
    assert of_n(17, FINEST)[0] > average(17, FINEST)


def test_a_finer_sensor_hardly_shows_finer_spots() -> None:
    usual, finest = (spot_mm(60.0, average(18, one)) for one in (USUAL, FINEST))
    assert usual == pytest.approx(2.3, abs=0.2)
    assert 0.6 * usual < finest < usual
    assert of_n(18, FINEST)[1] == pytest.approx(16 * of_n(18, USUAL)[1], rel=0.01)


def test_the_best_pupil_is_near_the_sharpest_whatever_the_sensor() -> None:
    for sensor in (USUAL, FINEST):
        real = of_n(18, sensor)[2]
        assert 0.8 < real.best_pupil < 1.6
        best, smaller, larger = (
            np.log(real.share(factor * real.best_pupil)).mean() for factor in (1, 0.7, 1.4)
        )
        assert best > max(smaller, larger)
