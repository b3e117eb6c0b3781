"""What weight does to a base on an axis, and what a calibration takes out of it."""

import numpy as np
import pytest

from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.prototype.gravity.compliance import rigid_motion
from tbcad.prototype.gravity.sag import LEFT, Sag
from tbcad.prototype.gravity.weighed import moved_by
from tbcad.types import Floats

ANGLE = np.radians([-100.0, -31.0, 0.0, 55.0, 101.0])
CENTRE = np.random.default_rng(3).uniform(20, 120, (6, 3))
HUB = np.array([-80.0, 0.0, 0.0])
NONE = np.zeros((5, 6, 3))


def flexible() -> Floats:
    some = np.random.default_rng(4).standard_normal((6, 6))
    scale = np.diag([1.0, 1, 1, 0.01, 0.01, 0.01])
    return np.asarray(scale @ some @ some.T @ scale * 1e-3)


def test_a_balanced_base_on_an_upright_axis_moves_the_same_way_at_each_stop() -> None:
    down = np.array([-1.0, 0.0, 0.0])
    load = np.array([30.0, 0.0, 0.0]), 2000.0
    moved = moved_by(flexible(), HUB, CENTRE, load, (ANGLE, down))
    static = rotated_about_x(moved, np.broadcast_to(ANGLE[:, None], moved.shape[:2]))
    place = rotated_about_x(np.broadcast_to(CENTRE, moved.shape), ANGLE[:, None])
    motion = flexible() @ np.array([-2000 * 9.80665e-3, 0, 0, 0, 0, 0])
    assert np.allclose(static, motion[:3] + np.cross(motion[3:], place - HUB))


def test_weight_beside_the_axis_turns_the_hub_by_its_moment() -> None:
    only_turns = np.diag([0, 0, 0, 1e-6, 1e-6, 1e-6])
    load = np.array([40.0, 100.0, 0.0]), 1000.0
    down = np.array([0.0, 0.0, -1.0])
    moved = moved_by(only_turns, HUB, CENTRE, load, (np.zeros(1), down))[0]
    moment = np.cross(load[0] - HUB, 9.80665 * down)
    assert np.allclose(moved, np.cross(1e-6 * moment, CENTRE - HUB))


def test_calibration_takes_out_the_motions_that_it_has() -> None:
    random = np.random.default_rng(6)
    rigid = np.einsum("kij,sj->ski", rigid_motion(CENTRE), random.standard_normal((5, 6)))
    lasting = random.standard_normal((6, 3))
    sag = Sag(ANGLE, CENTRE, np.eye(3), {"carrier": rigid + lasting}, NONE)
    assert sag.unmodelled(sag.whole, LEFT["six freedoms"]).max() == pytest.approx(0, abs=1e-12)
    assert sag.unmodelled(sag.whole, LEFT["turn and run-out"]).max() > 0.1


def test_the_longest_way_is_between_two_stops_of_one_ball() -> None:
    moved = NONE.copy()
    moved[1, 2], moved[4, 2], moved[3, 5] = [3, 0, 0], [0, 4, 0], [0, 0, 4.5]
    sag = Sag(ANGLE, CENTRE, np.eye(3), {"carrier": moved, "shaft": NONE}, NONE)
    assert sag.record()["between_stops_mm"] == pytest.approx(5.0)
    assert sag.record()["parts_between_stops_mm"]["shaft"] == 0
    assert "up to 5.00 mm" in sag.lines()[0]
