"""What a design asks of a camera, against closed forms and the paper's design."""

import math

import numpy as np
import pytest

from tbcad.core.camera.requirements import (
    DepthRange,
    camera_requirements,
    exposure_seconds,
    image_distances,
    virtual_images,
)
from tbcad.core.mirrors.array import MirrorArray
from tbcad.types import Floats
from tests.mirror_arrays import mirror_array

FAN = 1e-5  # distance of a fan's neighbouring ray from the apex, mm


def traced(curvature: float, incidence: float, distance: float, fan: Floats) -> float:
    """Distance behind a mirror of the image made by two neighbouring rays, by no formula.

    The sphere's apex is the origin, its normal z, the plane of incidence x, z. The image is where
    the neighbour, drawn backward, comes nearest to the principal ray.
    """
    source = distance * np.array([np.sin(incidence), 0.0, np.cos(incidence)])
    start, way = [], []
    for shift in (-0.5 * fan, 0.5 * fan):
        point = np.array([shift[0], shift[1], 0.0])
        radius = 1 / curvature
        point[2] = -(shift @ shift) / (radius + np.sqrt(radius**2 - shift @ shift))
        normal = (point + np.array([0.0, 0.0, radius])) / radius
        ray = (point - source) / np.linalg.norm(point - source)
        start.append(point)
        way.append(ray - 2 * (ray @ normal) * normal)
    between, difference = start[1] - start[0], way[1] - way[0]
    return float(between @ difference / (difference @ difference))


@pytest.mark.parametrize("curvature", [1 / 7, 1 / 65, 1e-4])
@pytest.mark.parametrize("incidence_deg", [0.0, 16.0, 35.0, 60.0])
@pytest.mark.parametrize("distance", [28.0, 138.0])
def test_coddington_agrees_with_traced_fans(
    curvature: float, incidence_deg: float, distance: float
) -> None:
    incidence = np.radians(incidence_deg)
    tangential, sagittal = image_distances(
        np.array(curvature), np.array(incidence), np.array(distance)
    )
    across, along = np.array([0.0, FAN]), np.array([FAN, 0.0])
    assert traced(curvature, incidence, distance, along) == pytest.approx(tangential, rel=1e-4)
    assert traced(curvature, incidence, distance, across) == pytest.approx(sagittal, rel=1e-4)


def test_one_image_on_the_axis() -> None:
    """1/s' = 1/s + 2/r at normal incidence: an object at r has its image at r / 3."""
    tangential, sagittal = image_distances(np.array(1 / 30), np.array(0.0), np.array(30.0))
    assert tangential == pytest.approx(10, rel=1e-15)
    assert sagittal == pytest.approx(10, rel=1e-15)


def test_flat_mirrors_show_the_object_at_twice_the_semi_major_axis() -> None:
    """The ellipsoid's two distances sum to 2a: images lie at 2a - R, 2a, 2a + R in both fans."""
    array = mirror_array("n=6", "radius_rule=flat")
    at = virtual_images(array, 30.0)
    twice = 2 * np.sqrt(100**2 + 100**2 / 2)
    expected = np.broadcast_to(twice + np.array([-30.0, 0, 30])[:, None], (len(array), 3, 2))
    assert at.distance == pytest.approx(expected, rel=1e-12)


def test_depth_is_what_the_camera_measures_along_its_axis() -> None:
    """The image point itself, from apex and ray, seen from the pinhole."""
    array = mirror_array("n=4")
    at = virtual_images(array, 30.0)
    pinhole = array.camera.pinhole
    way = (array.mirrors.apex - pinhole) / at.to_mirror[:, None]
    point = pinhole + at.distance[:, 1, 0][:, None] * way
    assert at.depth[:, 1, 0] == pytest.approx((point - pinhole) @ array.camera.forward, rel=1e-12)
    assert (at.depth < at.distance).all()


def test_incidence_is_that_of_the_paper_design(paper_array: MirrorArray) -> None:
    """16 ... 35 degrees at the apices, measured before (DESIGN.md section 3)."""
    incidence = np.degrees(virtual_images(paper_array, 30.0).incidence)
    assert (round(incidence.min()), round(incidence.max())) == (16, 35)


def test_flat_mirrors_have_images_where_their_virtual_cameras_see_the_object() -> None:
    """Planar mirrors only fold the path: depths are 2a -+ R along rays to the apices."""
    array = mirror_array("n=6", "radius_rule=flat")
    needed = camera_requirements(array, 30.0)
    ray = array.mirrors.apex - array.camera.pinhole
    cosine = ray @ array.camera.forward / np.linalg.norm(ray, axis=1)
    distance = 2 * array.ellipsoid.semi_major
    assert needed.near_mm == pytest.approx((distance - 30) * cosine.min(), rel=1e-12)
    assert needed.far_mm == pytest.approx((distance + 30) * cosine.max(), rel=1e-12)


def test_the_pupil_has_the_least_blur(paper_array: MirrorArray) -> None:
    """Blur circle and Airy disc are equal there, and any other pupil has more of both together."""
    needed = camera_requirements(paper_array, 30.0)
    assert needed.blur_px == pytest.approx(needed.airy_px, rel=1e-9)
    across = 2 * math.tan(math.radians(needed.hfov_deg / 2)) / needed.width_px
    for factor in (0.8, 1.25):
        pupil = factor * needed.pupil_mm
        blur = pupil * DepthRange(needed.near_mm, needed.far_mm).spread / 2 / across
        assert math.hypot(blur, 2.44 * 550e-6 / pupil / across) > needed.total_px


def test_all_corners_are_within_the_angles(paper_array: MirrorArray) -> None:
    needed, view = camera_requirements(paper_array, 30.0), paper_array.camera
    image = np.abs(view.project(paper_array.cells.corners) - [1039.5, 775.5])
    assert 2 * image[:, 0].max() == pytest.approx(needed.width_px, abs=1)
    assert 2 * image[:, 1].max() == pytest.approx(needed.height_px, abs=1)
    assert needed.hfov_deg < np.degrees(view.hfov)


def test_exposure_is_that_of_an_incident_light_meter() -> None:
    """ISO 2720: N^2 / t = E S / C with C = 250 lx s for a flat receptor; the mirror takes 45 %.

    18 % of the light against the meter's own 15.7 % (pi K / C) are a fifth of a stop.
    """
    seconds = exposure_seconds(16.0, 0.0, 100_000.0, 100.0) * 0.55
    meter = 16**2 * 250 / (100_000 * 100)
    assert seconds / meter == pytest.approx(math.pi * 12.5 / 250 / 0.18)
    assert exposure_seconds(8, 1.0, 1e4, 100) == pytest.approx(exposure_seconds(16, 0, 1e4, 100))
