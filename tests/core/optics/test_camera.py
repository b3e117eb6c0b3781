import cv2
import numpy as np
import pytest

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.camera import (
    Camera,
    LensCamera,
    vignetting,
    vignetting_slope,
    without_distortion,
)

AXIS = unit(np.array([0.3, -0.5, 0.8]))
CAMERA = LensCamera(
    pinhole=np.array([10.0, -20.0, 5.0]),
    axes=rotated(np.eye(3), AXIS, np.full(3, 0.4)),
    focal=np.array([1000.0, 1010.0]),
    principal=np.array([630.0, 480.0]),
    distortion=np.array([-0.1, 0.02, 1e-3, -5e-4, 3e-3]),
    width_px=1280,
    height_px=960,
)


def test_all_mirrors_of_the_paper_are_in_the_frame(paper_array: MirrorArray) -> None:
    """89 degrees across 2080 x 1552 pixels hold camera a's 847 mirrors."""
    camera = paper_array.camera
    assert camera.fill(paper_array.cells.corners) <= 1
    assert camera.forward @ camera.right == pytest.approx(0, abs=1e-12)
    assert abs(camera.forward[1]) < 1e-9  # the array is symmetric, and so is the camera


def test_no_small_tilt_does_better(paper_array: MirrorArray) -> None:
    camera, corners = paper_array.camera, paper_array.cells.corners
    best = camera.fill(corners)
    for tilt in (-1e-3, 1e-3):
        for axis in (camera.right, np.cross(camera.forward, camera.right)):
            forward = camera.forward + tilt * axis
            forward /= np.linalg.norm(forward)
            right = camera.right - (camera.right @ forward) * forward
            other = type(camera)(
                camera.pinhole, forward, right / np.linalg.norm(right), 2080, 1552, camera.hfov
            )
            assert other.fill(corners) >= best - 1e-9


@pytest.fixture
def points() -> np.ndarray:
    rng = np.random.default_rng(3)
    pixels = rng.uniform([0, 0], [1279, 959], size=(200, 2))
    distance = rng.uniform(50, 400, size=(200, 1))
    return CAMERA.pinhole + distance * CAMERA.directions(pixels)


def test_as_opencv_projects(points: np.ndarray) -> None:
    matrix = np.array([[1000.0, 0, 630], [0, 1010, 480], [0, 0, 1]])
    turn, _ = cv2.Rodrigues(CAMERA.axes)
    shift = -CAMERA.axes @ CAMERA.pinhole
    expected, _ = cv2.projectPoints(points, turn, shift, matrix, CAMERA.distortion)
    assert CAMERA.project(points) == pytest.approx(expected[:, 0], abs=1e-8)


def test_directions_undo_the_projection(points: np.ndarray) -> None:
    along = unit(points - CAMERA.pinhole)
    assert CAMERA.directions(CAMERA.project(points)) == pytest.approx(along, abs=1e-10)


def test_the_designed_camera_projects_alike(points: np.ndarray) -> None:
    axes = CAMERA.axes
    designed = Camera(CAMERA.pinhole, axes[2], axes[0], 1280, 960, 1.2)
    found = without_distortion(designed).project(points)
    assert found == pytest.approx(designed.project(points), abs=1e-9)


def test_slope_of_vignetting_is_that_of_its_logarithm() -> None:
    camera = without_distortion(
        Camera(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0]), 640, 480, 1.2)
    )
    pixels = np.array([[30.0, 40.0], [319.5, 239.5], [600.0, 100.0]])
    for axis, step in enumerate(0.01 * np.eye(2)):
        there, back = (
            np.log(vignetting(camera, camera.directions(pixels + side * step))) for side in (1, -1)
        )
        slope = (there - back) / 0.02
        assert vignetting_slope(camera, pixels)[:, axis] == pytest.approx(slope, rel=1e-6, abs=1e-9)


def test_mirrored_camera_sees_the_mirrored_array_alike(paper_array: MirrorArray) -> None:
    flipped = paper_array.cells.corners * [-1, 1, 1]
    camera = paper_array.camera
    assert camera.mirrored().fill(flipped) == pytest.approx(camera.fill(paper_array.cells.corners))
    assert np.linalg.det(
        [camera.right, np.cross(camera.forward, camera.right), camera.forward]
    ) == pytest.approx(1)
