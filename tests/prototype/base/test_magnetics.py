"""Pull of magnets: limits that are known in closed form, and what makers measure."""

import math

import pytest

from tbcad.prototype.base.holding import (
    DERATING,
    MU_0,
    REMANENCE_T,
    pull_of_pair,
    pull_on_ball,
    pull_on_plate,
)


def dipole_moment(radius: float, height: float) -> float:
    """Of a magnet in mm, A m^2."""
    return REMANENCE_T / MU_0 * math.pi * radius**2 * height * 1e-9


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


def test_pull_falls_with_the_gap_and_grows_with_the_height() -> None:
    pulls = [pull_on_ball(25.4, gap, 10.0, 5.0) for gap in (0.3, 0.5, 1.0, 2.0)]
    assert pulls == sorted(pulls, reverse=True)
    assert pull_on_ball(25.4, 0.5, 10.0, 3.0) < pulls[1]
