import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import GRAVITY, PointMasses, ball_masses, cap_volume, sum_masses
from tbcad.prototype.drive.drive import base_torques

# The paper's: w leans 45 degrees below the horizon.
FRAME = Ellipsoid(np.array([100.0, 0.0, -100.0]), 100.0).frame()


def at(along: float, radius: float, azimuth: float, mass: float = 100.0) -> PointMasses:
    place = np.array([[along, radius * np.cos(azimuth), radius * np.sin(azimuth)]])
    return PointMasses(np.array([mass]), place @ FRAME)


def turned(masses: PointMasses, angle: float) -> PointMasses:
    rotation = Rotation.from_rotvec(angle * FRAME[0])
    return PointMasses(masses.mass_g, rotation.apply(masses.centre))


class TestTorque:
    def test_it_is_that_of_its_weight(self) -> None:
        """Against w . (r x F) of the turned masses, from their places alone."""
        loads = [at(20, 100, 0.3), at(-40, 30, 2.0, 700.0), at(5, 80, -1.0, 30.0)]
        summed = sum_masses(FRAME, *loads)
        for angle in np.linspace(-3, 3, 7):
            force = np.array([0, 0, -GRAVITY])
            expected = sum(
                1e-3
                * masses.mass_g[0]
                * (FRAME[0] @ np.cross(turned(masses, angle).centre[0], force))
                for masses in loads
            )
            assert summed.torque(np.array([angle])) == pytest.approx(expected)

    @given(
        azimuth=st.floats(-7, 7),
        low=st.floats(-4, 4),
        width=st.floats(0, 6),
        mass=st.floats(1, 1e4),
    )
    def test_max_torque_is_that_of_all_angles(
        self, azimuth: float, low: float, width: float, mass: float
    ) -> None:
        summed = sum_masses(FRAME, at(0, 100, azimuth, mass), at(0, 30, 1.0))
        tried = np.abs(summed.torque(np.linspace(low, low + width, 2001))).max()
        assert tried <= summed.max_torque(low, low + width) * (1 + 1e-12)
        assert summed.max_torque(low, low + width) == pytest.approx(tried, rel=1e-5)

    def test_required_torque(self) -> None:
        balance = sum_masses(FRAME, at(0, 100, 0))
        inertia = 0.1 * 0.1**2  # kg m^2
        motion = MotionSpec(acceleration_deg_s2=np.degrees(3.0), safety=2.0)
        torques = base_torques(balance, (-2, 2), motion)
        assert torques.gravity == balance.torque_amplitude
        assert torques.peak == pytest.approx(balance.torque_amplitude + 1e3 * inertia * 3)
        assert torques.required == 2 * torques.peak


class TestBalls:
    def test_balls_weigh_where_they_sit(self, small_prototype: PrototypeLayout) -> None:
        masses = ball_masses(small_prototype)
        bought = ~small_prototype.balls.cap
        assert len(masses) == len(small_prototype)
        assert masses.mass_g[bought].sum() == pytest.approx(small_prototype.mass_g)
        assert (masses.centre == small_prototype.body_centres()).all()

    def test_caps_by_slices(self, small_prototype: PrototypeLayout) -> None:
        """Their volume as the sum of thin discs: within both spheres."""
        balls = small_prototype.balls
        assert balls.cap.any()
        for j in np.flatnonzero(balls.cap):
            body, radius, depth = balls.body_radius[j], balls.radius[j], balls.body_depth[j]
            edge = min(body / np.sqrt(2), radius) if body < radius else body
            drop = radius - np.sqrt(radius**2 - edge**2)
            x = np.linspace(0, depth + body, 200_001)  # behind the apex
            front = np.where(x < drop, radius**2 - (radius - x) ** 2, np.inf)
            back = body**2 - (x - depth) ** 2
            area = np.pi * np.where(x < drop, front, np.maximum(back, 0))
            assert cap_volume(balls)[j] == pytest.approx(np.trapezoid(area, x), rel=1e-5)
