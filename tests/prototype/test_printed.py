"""Printed parts: solids of primitives, and pads on the bed."""

import numpy as np
import pytest

from tbcad.cad.kernel.checks import properties
from tbcad.cad.kernel.solids import faces, fused, one_solid
from tbcad.core.geometry.primitives import Slot, slot_parts, volume
from tbcad.core.geometry.vectors import unit
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.printed import (
    NO_PADS,
    downward_pads,
    leaning_poses,
    opening_up,
    primitive_solid,
)

TILTED = unit(np.array([0.3, -0.5, 0.8]))


def cone(axis: np.ndarray, angle_deg: float, count: int = 12) -> np.ndarray:
    """Unit vectors at an angle about an axis."""
    side = unit(np.cross(axis, [0.2, 0.5, 0.8]))
    turn = 2 * np.pi * np.arange(count) / count
    across = np.outer(np.cos(turn), side) + np.outer(np.sin(turn), np.cross(axis, side))
    angle = np.radians(angle_deg)
    return np.cos(angle) * axis + np.sin(angle) * across


def test_the_middle_of_a_cone_is_up(carrier: BaseLayout) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    assert opening_up(cone(axis, 50.0)) == pytest.approx(-axis, abs=1e-6)
    assert opening_up(np.vstack([np.eye(3), -np.eye(3)])) is None
    assert opening_up(NO_PADS) is None
    normals = carrier.seats.pad_normals.reshape(-1, 3)
    down = opening_up(normals)
    assert down is not None
    assert (normals @ down).max() < 0


def test_pads_are_counted() -> None:
    normals = cone(np.array([0.0, 0.0, 1.0]), 100.0, 8)
    assert downward_pads(normals, np.eye(3)) == (0, 8)
    assert downward_pads(normals, np.diag([1.0, -1.0, -1.0])) == (0, 0)
    assert downward_pads(np.array([[0.0, 0.0, -1.0]]), np.eye(3)) == (1, 1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_slot_is_the_union_of_its_parts(sign: float) -> None:
    across = unit(np.cross(TILTED, [1.0, -2.0, 3.0]))
    slot = Slot(np.array([1.0, -2.0, 3.0]), sign * 4 * across, 2.0, 7 * TILTED)
    solid = one_solid("slot", primitive_solid(slot))
    found = properties(solid)
    expected = properties(fused([primitive_solid(part) for part in slot_parts(slot)]))
    assert len(faces(solid)) == 6
    assert found.volume == pytest.approx(volume(slot), rel=1e-12)
    assert found.volume == pytest.approx(expected.volume, rel=1e-9)
    assert found.area == pytest.approx(expected.area, rel=1e-9)
    assert found.centroid == pytest.approx(expected.centroid, abs=1e-9)


def test_poses_lean_as_little_as_can_be_and_need_no_support() -> None:
    normals = cone(TILTED, 40)
    poses = leaning_poses(normals)
    lowest = (normals @ -poses.T).min(axis=0)
    assert unit(poses[0]) @ TILTED == pytest.approx(-1, abs=1e-3)
    assert (np.diff(lowest) <= 0).all()
    assert lowest[-1] == pytest.approx(-np.sqrt(0.5), abs=0.01)
    corners = np.stack(np.meshgrid(*[(-1, 1)] * 3), axis=-1).reshape(-1, 3) / np.sqrt(3)
    assert len(leaning_poses(np.vstack([np.eye(3), -np.eye(3), corners]))) == 0
