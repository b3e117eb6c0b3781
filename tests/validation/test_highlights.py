"""Highlights of spheres against closed forms."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.rig.calibration.estimate.jacobian import reflections

PINHOLE = np.array([100.0, 0.0, -100.0])
CENTRE = np.array([[140.0, 35.0, 60.0], [90.0, -70.0, 120.0]])
RADIUS = np.array([12.0, 40.0])


def test_light_at_the_pinhole_comes_back_along_the_line_to_the_centre() -> None:
    """P = c + r e with e toward the pinhole; dP/dc = 1 - r / |O - c| (1 - e e^T)."""
    found = reflections(CENTRE, RADIUS, np.broadcast_to(PINHOLE, CENTRE.shape), PINHOLE)
    way = PINHOLE - CENTRE
    e, distance = unit(way), norm(way)
    assert found.point == pytest.approx(CENTRE + RADIUS[:, None] * e, abs=1e-9)
    across = np.eye(3) - e[:, :, None] * e[:, None]
    expected = np.eye(3) - (RADIUS / distance)[:, None, None] * across
    # Light and pinhole are both at O here, so a sphere's place turns the normal fully about O.
    assert found.by_centre == pytest.approx(expected, abs=1e-9)
    assert found.by_radius == pytest.approx(e, abs=1e-9)


def test_a_distant_light_is_in_the_focus_of_a_small_sphere() -> None:
    """Paraxial: light at distance a appears at f a / (a + f) behind the apex, f = r / 2."""
    radius, distance, aside = 2.0, 1e4, 1.0
    centre = np.zeros((1, 3))
    pinhole = np.array([0.0, 0.0, distance])
    light = np.array([[aside, 0.0, distance]])
    found = reflections(centre, np.array([radius]), light, pinhole)
    # The bisector of both ways, seen from the centre: half of the angle between them.
    assert found.point[0, 0] == pytest.approx(radius * aside / (2 * distance), rel=1e-3)


def test_on_the_bisecting_plane_the_normal_halves_the_angle() -> None:
    """Light and pinhole at the same distance from the centre: the normal is their mean."""
    e, f = unit(np.array([0.3, 0.1, 1.0])), unit(np.array([-0.2, 0.4, 0.9]))
    found = reflections(np.zeros((1, 3)), np.array([25.0]), 180 * f[None], 180 * e)
    assert found.point[0] == pytest.approx(25 * unit(e + f), abs=1e-9)
