"""What a design asks of a camera, against closed forms and the paper's design."""

import math

import numpy as np
import pytest

from tbcad.camera.lens import DepthRange
from tbcad.camera.requirements import camera_requirements, exposure_seconds
from tbcad.mirrors.array import MirrorArray
from tests.mirror_arrays import mirror_array


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
