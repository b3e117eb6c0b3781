"""What holds the balls: the force needed at every angle, the magnets chosen for it."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.geometry.rotations import rotated
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.held import held_balls
from tbcad.prototype.base.holding import (
    AT_DEFAULT_SPEED,
    MIN_RATIO,
    Motion,
    base_motion,
    force_needed,
)
from tbcad.prototype.base.layout import base_layout
from tbcad.prototype.base.pockets import pad_normals
from tbcad.prototype.drive.balance import GRAVITY
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec
from tbcad.spec.prototype import BaseSpec

AT_REST = Motion(0.0, 0.0, 1.27)
TILT = np.radians(50.0)


def frame_about(axis: np.ndarray) -> np.ndarray:
    along = axis / np.linalg.norm(axis)
    across = np.cross(along, [0.3, 0.9, 0.1])
    across /= np.linalg.norm(across)
    return np.stack([along, across, np.cross(along, across)])


def test_the_default_motion_is_that_of_the_defaults() -> None:
    assert base_motion(load_spec(None)) == AT_DEFAULT_SPEED


class TestForceNeeded:
    def test_upside_down_on_a_vertical_axis_it_is_the_weight(self) -> None:
        """The axis of the base is vertical, that of the seat points up: gravity never turns."""
        frame = frame_about(np.array([0.0, 0.0, 1.0]))
        normals = pad_normals(TILT, np.zeros(1))
        axis, centre = np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3))
        needed = force_needed(normals, axis, centre, np.array([100.0]), frame, AT_REST)
        assert needed == pytest.approx([0.1 * GRAVITY])

    def test_a_ball_on_its_back_needs_none(self) -> None:
        frame = frame_about(np.array([0.0, 0.0, 1.0]))
        normals = pad_normals(TILT, np.zeros(1)) * [1, 1, -1]
        axis, centre = np.array([[0.0, 0.0, -1.0]]), np.zeros((1, 3))
        needed = force_needed(normals, axis, centre, np.array([100.0]), frame, AT_REST)
        assert needed[0] < 0

    @pytest.mark.parametrize("seed", range(4))
    def test_all_pads_bear_load_with_it_and_one_does_not_with_less(self, seed: int) -> None:
        """By turning the base in small steps and solving for the reactions."""
        random = np.random.default_rng(seed)
        frame = frame_about(random.normal(size=3))
        axes = frame_about(random.normal(size=3))[[1, 2, 0]]
        normals = pad_normals(TILT, random.uniform(0, 2, 1)) @ axes
        centre, mass = random.normal(size=(1, 3)) * 100, 0.3
        motion = Motion(0.4, 2.0, 1.27)
        needed = force_needed(normals, axes[2:], centre, np.array([1000 * mass]), frame, motion)
        along, out = frame[0], centre[0] * 1e-3
        out = out - (out @ along) * along
        least = np.inf
        for angle in np.linspace(0, 2 * np.pi, 1440):
            down = rotated(np.array([0.0, 0.0, -GRAVITY]), along, np.array(-angle))
            for sense in (-1, 1):
                pull = down + motion.speed**2 * out
                pull = pull + sense * motion.acceleration * np.cross(along, out)
                total = mass * pull + needed[0] * axes[2]
                least = min(least, float(np.linalg.solve(normals[0].T, -total).min()))
        assert 0 <= least < 1e-4 * needed[0]


class TestMagnets:
    def test_every_ball_is_held_twice(self, paper_prototype: PrototypeLayout) -> None:
        base = base_layout(BaseSpec(), paper_prototype)
        held = held_balls(base, paper_prototype, AT_DEFAULT_SPEED)
        assert (held.available >= MIN_RATIO * held.needed).all()
        assert (held.wider < held.available).all()
        assert not held.glued.any()

    def test_strong_magnets_are_only_where_they_are_needed(
        self, paper_prototype: PrototypeLayout
    ) -> None:
        seats = base_layout(BaseSpec(), paper_prototype).seats
        strong = seats.magnet_height > BaseSpec().magnet_height_mm
        assert 0 < strong.sum() < len(seats)
        assert seats.radius[strong].min() > seats.radius[~strong].max()
        assert seats.bottom == pytest.approx(
            seats.radius + BaseSpec().magnet_gap_mm + seats.magnet_height
        )

    def test_a_ball_that_no_magnet_holds_is_refused(self, paper_prototype: PrototypeLayout) -> None:
        weak = BaseSpec(hold="magnet", magnet_gap_mm=4.0)
        with pytest.raises(SpecError, match=r"ball 3 of 2 in needs 2 times .* its magnet of 20 mm"):
            base_layout(weak, paper_prototype)

    def test_a_quick_base_needs_more(self, small_prototype: PrototypeLayout) -> None:
        base = base_layout(BaseSpec(), small_prototype)
        quick = replace(AT_DEFAULT_SPEED, acceleration=50.0)
        assert (
            held_balls(base, small_prototype, quick).needed
            > held_balls(base, small_prototype, AT_DEFAULT_SPEED).needed
        ).all()

    def test_glue_holds_as_its_area_does(self, small_prototype: PrototypeLayout) -> None:
        held = held_balls(
            base_layout(BaseSpec(hold="glue"), small_prototype), small_prototype, AT_DEFAULT_SPEED
        )
        assert held.glued.all()
        assert (held.wider == held.available).all()
        assert (held.available >= MIN_RATIO * held.needed).all()
