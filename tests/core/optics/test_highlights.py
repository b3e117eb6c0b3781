"""Where a sphere shows a light, against the law of reflection."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.reflection import reflection_points


@pytest.mark.parametrize("radius", [1.0, 20.0, 300.0, 5000.0])
def test_light_of_the_led_is_reflected_to_the_pinhole(radius: float) -> None:
    """Angles of incidence and of reflection are equal, also on spheres much larger than the rig."""
    rng = np.random.default_rng(1)
    pinhole, place = np.array([100.0, 0.0, -100.0]), np.array([5.0, 20.0, -3.0])
    apex = unit(rng.normal(loc=(0, 0, 1.5), size=(200, 3))) * 150
    normal = unit(unit(place - apex) + unit(pinhole - apex) + 0.05 * rng.normal(size=(200, 3)))
    centre = apex - radius * normal
    point = reflection_points(centre, np.full(200, radius), place, pinhole)
    assert norm(point - centre) == pytest.approx(np.full(200, radius))
    to_led, to_pinhole = unit(place - point), unit(pinhole - point)
    assert norm(np.cross(unit(to_led + to_pinhole), unit(point - centre))).max() < 1e-9
