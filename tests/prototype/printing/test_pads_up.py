"""The pose in which no pad faces down."""

import numpy as np
import pytest

from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import base_layout
from tbcad.prototype.printing.placing import NO_PADS, downward_pads, opening_up
from tbcad.spec.prototype import BaseSpec


def cone(axis: np.ndarray, angle_deg: float, count: int = 12) -> np.ndarray:
    """Unit vectors at an angle about an axis."""
    side = np.cross(axis, [0.2, 0.5, 0.8])
    side /= np.linalg.norm(side)
    turn = 2 * np.pi * np.arange(count) / count
    across = np.outer(np.cos(turn), side) + np.outer(np.sin(turn), np.cross(axis, side))
    angle = np.radians(angle_deg)
    return np.cos(angle) * axis + np.sin(angle) * across


def test_the_middle_of_a_cone_is_up() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    assert opening_up(cone(axis, 50.0)) == pytest.approx(-axis, abs=1e-6)


def test_no_direction_for_pads_all_round() -> None:
    assert opening_up(np.vstack([np.eye(3), -np.eye(3)])) is None
    assert opening_up(NO_PADS) is None


def test_pads_are_counted() -> None:
    normals = cone(np.array([0.0, 0.0, 1.0]), 100.0, 8)
    assert downward_pads(normals, np.eye(3)) == (0, 8)
    assert downward_pads(normals, np.diag([1.0, -1.0, -1.0])) == (0, 0)
    assert downward_pads(np.array([[0.0, 0.0, -1.0]]), np.eye(3)) == (1, 1)


def test_no_pad_of_the_paper_faces_down(paper_prototype: PrototypeLayout) -> None:
    normals = base_layout(BaseSpec(), paper_prototype).seats.pad_normals.reshape(-1, 3)
    down = opening_up(normals)
    assert down is not None
    assert (normals @ down).max() < 0
