import numpy as np
import pytest

from tbcad.mirrors.array import MirrorArray
from tbcad.optics.camera import fitted_camera


def test_all_mirrors_of_the_paper_are_in_the_frame(paper_half: MirrorArray) -> None:
    """89 degrees across 2080 x 1552 pixels hold camera a's 847 mirrors."""
    view = paper_half.camera
    assert view.fill(paper_half.cells.corners) <= 1
    assert view.forward @ view.right == pytest.approx(0, abs=1e-12)
    assert abs(view.forward[1]) < 1e-9  # the array is symmetric, and so is the camera


def test_no_small_turn_does_better(paper_half: MirrorArray) -> None:
    view, corners = paper_half.camera, paper_half.cells.corners
    best = view.fill(corners)
    for turn in (-1e-3, 1e-3):
        for axis in (view.right, np.cross(view.forward, view.right)):
            forward = view.forward + turn * axis
            forward /= np.linalg.norm(forward)
            right = view.right - (view.right @ forward) * forward
            other = type(view)(
                view.pinhole, forward, right / np.linalg.norm(right), 2080, 1552, view.hfov
            )
            assert other.fill(corners) >= best - 1e-9


def test_mirrored_camera_sees_the_mirrored_array_alike(paper_half: MirrorArray) -> None:
    flipped = paper_half.cells.corners * [-1, 1, 1]
    view = paper_half.camera
    assert view.mirrored().fill(flipped) == pytest.approx(view.fill(paper_half.cells.corners))
    assert np.linalg.det(
        [view.right, np.cross(view.forward, view.right), view.forward]
    ) == pytest.approx(1)


def test_a_point_behind_the_camera_is_told() -> None:
    view = fitted_camera(np.array([0.0, 0, -9]), np.array([[0.1, 0, 0], [0, 0.1, 0]]), 100, 80, 1.0)
    assert view.fill(np.array([[0.0, 0.0, -20.0]])) == np.inf
