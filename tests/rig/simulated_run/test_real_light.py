"""Frames of a run behind a real lens: places, Coddington's spread, sums, and the object."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.camera.requirements import image_distances
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.lens import KERNEL_PX, PupilLens, kernel_factors, pixel_kernel, through_pupil
from tbcad.core.optics.reflection import reflection_points
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.capture.sensor import SimulatedSensor
from tbcad.rig.simulated_run import real_light
from tbcad.rig.simulated_run.led_light import Occluders
from tbcad.rig.simulated_run.photographs import ImagingChain
from tests.rig.simulated_run.test_photographs import ONE
from tests.simulated_runs import Small, small_run

FOCUS = 140.0
CAMERA = LensCamera(
    np.array([1.0, 2.0, -100.0]),
    np.eye(3),
    np.array([300.0, 301.0]),
    np.array([159.5, 119.5]),
    np.array([-0.05, 0.01, 1e-3, -1e-3, 0.0]),
    320,
    240,
)
OPTICS = RealOptics(PupilLens(0.85, FOCUS), 1.0, np.zeros(1))
SILENT = SimulatedSensor(noise=0.0, hot_share=0.0, grains=0)


def test_what_is_in_focus_is_in_one_place_through_the_whole_pupil() -> None:
    near = CAMERA.pinhole + np.array([[10.0, -20.0, FOCUS], [40.0, 15.0, FOCUS], [3.0, 2.0, 90.0]])
    for point in ([0.4, 0.0, 0.0], [-0.1, 0.3, 0.0]):
        through = through_pupil(CAMERA, np.array(point), FOCUS)
        seen, before = through.project(near), CAMERA.project(near)
        assert seen[:2] == pytest.approx(before[:2], abs=1e-9)
        assert norm(seen - before)[2] > 0.3
        assert through.directions(seen) == pytest.approx(unit(near - through.pinhole), abs=1e-9)


def test_directions_between_pixels_are_the_cameras() -> None:
    row, column = np.mgrid[:240, :320]
    directions = CAMERA.directions(np.stack([column, row], axis=-1).astype(float))
    places = np.random.default_rng(1).uniform((-0.3, -0.3), (319.3, 239.3), (500, 2))
    # A millionth of a radian is 3e-4 pixels; four times the pixels bend a sixteenth as much.
    off = real_light.between(directions, places) - CAMERA.directions(places)
    assert np.abs(off).max() < 5e-6


def test_a_highlight_is_as_wide_as_coddington_says() -> None:
    """The middle of an LED through four points of the pupil: its astigmatic images' defocus."""
    machine = ONE.machine
    camera, led = machine.camera, machine.leds[0]
    frame = real_light.RealFrame(ONE, 0, False, np.zeros((601, 801, 3)), OPTICS)
    points = frame.led_points(Occluders(None, None), 1e-4, 1e-9)
    found = np.cov(points.pixel.T, aweights=points.area, ddof=0)
    chief = reflection_points(machine.centre, machine.radius, led[None], camera.pinhole)[0]
    way, normal = unit(chief - camera.pinhole), unit(chief - machine.centre[0])
    incidence = np.arccos(-dot(way, normal))
    images = image_distances(1 / machine.radius[0], incidence, norm(led - chief))
    tangential, sagittal = np.array(images) + norm(chief - camera.pinhole)
    across = unit(np.cross(way, normal))
    within = np.cross(way, across)
    vergence = np.outer(across, across) / sagittal + np.outer(within, within) / tangential
    ahead, aside = camera.axes @ way, camera.axes[:2].T
    # Of the place x / z, y / z by a change of the direction, which is less the vergence times the
    # point of the pupil.
    place = np.eye(2, 3) / ahead[2] - np.outer(ahead[:2], [0, 0, 1]) / ahead[2] ** 2
    slope = camera.focal.mean() * (np.eye(2) / FOCUS - place @ camera.axes @ vergence @ aside)
    variance = (OPTICS.ray_share * OPTICS.lens.pupil_mm / 4) ** 2
    assert found == pytest.approx(variance * slope @ slope.T, rel=5e-3, abs=1e-4)


@pytest.mark.parametrize("place", [(15.0, 10.0), (14.3, 9.8), (15.49, 10.51)])
def test_a_point_is_spread_as_the_kernel_says_about_its_place(place: tuple[float, float]) -> None:
    """But for what its end at 3.5 pixels cuts off on one side."""
    kernel = pixel_kernel(0.9, real_light.PLACES)
    factors = kernel_factors(kernel)
    factors[:, :-1] *= real_light.PLACES
    image = np.zeros((21, 31), dtype=np.float32)
    point = np.array([place]), np.array([2.0])
    real_light._add_spread(image, *point, factors, real_light.PLACES, KERNEL_PX)
    row, column = np.indices(image.shape)
    total = float(image.sum())
    assert total == pytest.approx(2 * kernel.sum(), rel=0.01)
    assert (image * column).sum() / total == pytest.approx(place[0], abs=7e-3)
    assert (image * row).sum() / total == pytest.approx(place[1], abs=7e-3)


@pytest.fixture(scope="module")
def small(export_folder: Path) -> Small:
    return small_run(export_folder, (20,), ImagingChain(SILENT))


def test_an_object_is_as_bright_as_by_a_pinhole_in_both_runs(small: Small) -> None:
    """A pupil of no depth: what is left is the spread, and light that the lens throws aside."""
    focus = norm(small.machine.centre - small.machine.camera.pinhole).mean()
    optics = RealOptics(PupilLens(0.85, float(focus)), 1.0, np.full(5, 3.0))
    real = replace(small.run, chain=replace(small.run.chain, real=optics))
    for number in range(len(small.run.frames)):
        ideal, seen = (
            run.frame_photographs(number, ("lit",))["lit"].astype(float)
            for run in (small.run, real)
        )
        assert seen.mean() == pytest.approx(ideal.mean(), rel=0.05)
        assert np.corrcoef(seen.ravel(), ideal.ravel())[0, 1] > 0.9


def test_highlights_lose_no_light_to_the_lens(small: Small) -> None:
    optics = RealOptics(PupilLens(0.85, FOCUS), 1.0, np.full(5, 3.0))
    real = replace(small.run, chain=replace(small.run.chain, real=optics))
    frame = real._real(0)
    assert frame is not None
    bright = np.full(4, 1.0)
    images = frame.led_images(small.run.occluders, 1.5, bright, 2e-3)
    points = frame.led_points(small.run.occluders, 1.5, 2e-3)
    for led, image in enumerate(images):
        assert image.sum() == pytest.approx(points.of(led)[1].sum(), rel=0.02)
