"""What holds the balls: the force needed at every angle, the magnets chosen for it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.rotations import rotated
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.caps import holding
from tbcad.prototype.base.holding import (
    DERATING,
    MIN_RATIO,
    MU_0,
    REMANENCE_T,
    Motion,
    force_needed,
    pad_normals,
    pull_of_pair,
    pull_on_ball,
)
from tbcad.prototype.base.layout import base_layout
from tbcad.prototype.drive.balance import GRAVITY
from tbcad.prototype.purchased.parts import load_parts
from tbcad.records.prototype import HeldBall


def dipole_moment(radius: float, height: float) -> float:
    """Of a magnet in mm, A m^2."""
    return REMANENCE_T / MU_0 * math.pi * radius**2 * height * 1e-9


def pull_on_plate(gap: float, magnet: float, height: float) -> float:
    """Pull on a thick steel plate, N, derated: on the magnet's own mirror image."""
    return pull_of_pair(magnet, magnet, 2 * gap, (height, height))


def test_a_large_ball_is_a_plate() -> None:
    assert pull_on_ball(5000.0, 0.5, 7.5, 3.0) == pytest.approx(
        pull_on_plate(0.5, 7.5, 3.0), rel=5e-3
    )
    assert pull_on_ball(25.0, 0.5, 7.5, 3.0) < pull_on_plate(0.5, 7.5, 3.0)


def test_a_small_ball_far_away_is_an_induced_dipole() -> None:
    """On an axis F = m_ball dB/dz, with m_ball = 4 pi R^3 B / mu0 and B = mu0 m / (2 pi z^3)."""
    ball, gap, radius, height = 0.5, 60.0, 1.0, 1.0
    distance = (ball + gap + height / 2) * 1e-3
    moment = dipole_moment(radius, height)
    field = MU_0 * moment / (2 * math.pi * distance**3)
    force = 4 * math.pi * (ball * 1e-3) ** 3 * field / MU_0 * 3 * field / distance
    assert pull_on_ball(ball, gap, radius, height) == pytest.approx(DERATING * force, rel=2e-3)


def test_two_magnets_far_apart_are_dipoles() -> None:
    """F = 3 mu0 m1 m2 / (2 pi z^4) on a common axis."""
    distance = (40.0 + 1.0) * 1e-3
    one, two = dipole_moment(1.0, 1.0), dipole_moment(0.8, 1.0)
    force = 3 * MU_0 * one * two / (2 * math.pi * distance**4)
    assert pull_of_pair(1.0, 0.8, 40.0, (1.0, 1.0)) == pytest.approx(DERATING * force, rel=5e-3)


@pytest.mark.parametrize(
    ("diameter", "height", "remanence", "newton"),
    [
        (10.0, 5.0, 1.29, 25.5),  # supermagnete S-10-05-N, N42: about 2.6 kg
        (15.0, 3.0, 1.22, 26.61),  # dhit.pl 030182 (a ring), N38
        (15.0, 5.0, 1.22, 49.95),  # dhit.pl 030390 (a ring), N38
    ],
)
def test_catalogues_have_at_least_the_derated_pull_on_a_plate(
    diameter: float, height: float, remanence: float, newton: float
) -> None:
    share = (remanence / REMANENCE_T) ** 2
    derated = pull_on_plate(1e-3, diameter / 2, height) * share
    assert derated <= newton <= 1.02 * derated / DERATING


AT_REST = Motion(0.0, 0.0)
TILT = np.radians(50.0)


def frame_about(axis: np.ndarray) -> np.ndarray:
    along = axis / np.linalg.norm(axis)
    across = np.cross(along, [0.3, 0.9, 0.1])
    across /= np.linalg.norm(across)
    return np.stack([along, across, np.cross(along, across)])


class TestForceNeeded:
    def test_on_a_vertical_axis_it_is_the_weight_upside_down_and_none_on_its_back(self) -> None:
        """Gravity never turns."""
        frame, axis = frame_about(np.array([0.0, 0.0, 1.0])), np.array([[0.0, 0.0, 1.0]])
        normals, still = pad_normals(TILT, np.zeros(1)), (np.zeros((1, 3)), np.array([100.0]))
        needed = force_needed(normals, axis, *still, frame, AT_REST)
        assert needed == pytest.approx([0.1 * GRAVITY])
        assert force_needed(normals * [1, 1, -1], -axis, *still, frame, AT_REST)[0] < 0

    @pytest.mark.parametrize("seed", range(4))
    def test_all_pads_bear_load_with_it_and_one_does_not_with_less(self, seed: int) -> None:
        """By turning the base in small steps and solving for the reactions."""
        random = np.random.default_rng(seed)
        frame = frame_about(random.normal(size=3))
        axes = frame_about(random.normal(size=3))[[1, 2, 0]]
        normals = pad_normals(TILT, random.uniform(0, 2, 1)) @ axes
        centre, mass = random.normal(size=(1, 3)) * 100, 0.3
        motion = Motion(0.4, 2.0)
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


def held(spec: BaseSpec, prototype: PrototypeLayout) -> tuple[HeldBall, ...]:
    return holding(base_layout(spec, prototype), prototype, load_parts()).balls


class TestMagnets:
    def test_every_ball_is_held_twice_by_strong_magnets_only_where_needed(
        self, paper_prototype: PrototypeLayout
    ) -> None:
        spec = BaseSpec()
        for one in held(spec, paper_prototype):
            assert one.by == "magnet"
            assert one.force_available_n >= MIN_RATIO * one.force_needed_n
            assert one.wider_gap_n < one.force_available_n
        seats = base_layout(spec, paper_prototype).seats
        strong = seats.magnet_height > spec.magnet_height_mm
        assert 0 < strong.sum() < len(seats)
        assert seats.radius[strong].min() > seats.radius[~strong].max()
        ends = seats.radius + spec.magnet_gap_mm + seats.magnet_height
        assert seats.bottom == pytest.approx(ends)
        weak = BaseSpec(hold="magnet", magnet_gap_mm=4.0)
        with pytest.raises(SpecError, match=r"ball 3 of 2 in needs 2 times .* its magnet of 20 mm"):
            base_layout(weak, paper_prototype)

    def test_a_quick_base_needs_more_and_glue_holds(self, small_prototype: PrototypeLayout) -> None:
        quick = load_spec(None, ["n=6", "prototype.k=4", "acceleration_deg_s2=2000"])
        base = base_layout(BaseSpec(), small_prototype)
        some = (replace(small_prototype, spec=quick), small_prototype)
        rows = (holding(base, one, load_parts()).balls for one in some)
        for more, less in zip(*rows, strict=True):
            assert more.force_needed_n > less.force_needed_n
        for one in held(BaseSpec(hold="glue"), small_prototype):
            assert (one.by, one.magnet) == ("glue", None)
            assert one.wider_gap_n == one.force_available_n >= MIN_RATIO * one.force_needed_n
