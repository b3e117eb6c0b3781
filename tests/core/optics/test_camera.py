import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.camera import fitted_camera


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


def test_mirrored_camera_sees_the_mirrored_array_alike(paper_array: MirrorArray) -> None:
    flipped = paper_array.cells.corners * [-1, 1, 1]
    camera = paper_array.camera
    assert camera.mirrored().fill(flipped) == pytest.approx(camera.fill(paper_array.cells.corners))
    assert np.linalg.det(
        [camera.right, np.cross(camera.forward, camera.right), camera.forward]
    ) == pytest.approx(1)


def test_a_point_behind_the_camera_fills_more_than_any_frame() -> None:
    camera = fitted_camera(
        np.array([0.0, 0, -9]), np.array([[0.1, 0, 0], [0, 0.1, 0]]), 100, 80, 1.0
    )
    assert camera.fill(np.array([[0.0, 0.0, -20.0]])) == np.inf
