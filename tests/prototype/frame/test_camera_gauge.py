"""The gauge for the camera's place: its pictures, and how well they tell the pinhole's place."""

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest

from tbcad.core.camera.requirements import camera_requirements
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.frame import camera_gauge
from tbcad.prototype.frame.camera_gauge import CameraGauge, marks_seen
from tbcad.prototype.part import FrameLayout, Site
from tests.prototype.conftest import CAPTURE_RADIUS

TRIALS = 20_000


@pytest.fixture(scope="module")
def gauge(frame: FrameLayout) -> CameraGauge:
    return frame.of(CameraGauge)


@pytest.fixture(scope="module")
def camera(small_prototype: PrototypeLayout) -> Camera:
    return small_prototype.array.camera


def test_pictures_are_those_of_the_turned_marks(
    gauge: CameraGauge, camera: Camera, carrier: BaseLayout
) -> None:
    """A quarter turn brings the arm into the frame's plane: the middle column."""
    low, left, right, high = marks_seen(gauge, carrier, camera)
    middle = (camera.width_px - 1) / 2
    turn = abs(gauge.angles[0])
    assert abs(low.column_px - middle) < 0.05 * camera.width_px * (90.5 - turn)
    assert abs(high.column_px - middle) < 0.05 * camera.width_px * (90.5 - turn)
    assert left.column_px + right.column_px == pytest.approx(2 * middle)
    expected = camera.project(gauge.marks[0, 0])
    assert [left.column_px, left.row_px] == pytest.approx(expected.tolist())


def test_the_pinhole_found_is_as_near_as_stated(gauge: CameraGauge, camera: Camera) -> None:
    """Simulated alignments: lengths and readings with errors, the apex of both lines found."""
    rng, sizes = np.random.default_rng(5), gauge.sizes
    place = float(norm(camera.pinhole))
    near, far = (
        place - along + 0.03 * rng.standard_normal(TRIALS) for along in (sizes.near, sizes.far)
    )
    near_half, far_half = (
        half + 0.015 * rng.standard_normal(TRIALS) for half in (sizes.near_half, sizes.far_half)
    )
    # Where lines through near and far marks of both sides meet the axis, before the pinhole.
    apex = (near_half * far - far_half * near) / (near_half - far_half)
    from_lengths = float(np.std(apex))
    assert 0.3 * gauge.errors["along_mm"] < from_lengths < gauge.errors["along_mm"]
    assert max(gauge.errors.values()) < 0.2


def test_a_wider_pupil_and_a_larger_lens_tell_less(
    gauge: CameraGauge, site: Site, frame: FrameLayout
) -> None:
    needed = camera_requirements(site.layout.array, CAPTURE_RADIUS)
    wide = replace(needed, pupil_mm=4 * needed.pupil_mm)
    with mock.patch.object(camera_gauge, "camera_requirements", return_value=wide):
        worse = camera_gauge.camera_gauge(site, frame)
    assert worse
    assert all(worse.errors[name] > value for name, value in gauge.errors.items())
    prototype = site.spec.prototype.model_copy(update={"camera_diameter_mm": 120.0})
    spec = site.spec.model_copy(update={"prototype": prototype})
    large = camera_gauge.camera_gauge(replace(site, spec=spec), frame)
    assert large
    assert large.sizes.near < gauge.sizes.near
    assert large.errors["along_mm"] > gauge.errors["along_mm"]
