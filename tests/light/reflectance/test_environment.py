"""Light from all around, and the lamps that stand for it."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import unit
from tbcad.light.reflectance.environment import environment, even_directions
from tests.light.reflectance.conftest import sky


def test_an_even_sky_gives_the_irradiance_of_a_hemisphere() -> None:
    """Light 1 from everywhere above: pi on a surface that faces up, 2 pi over all directions."""
    found = environment(np.ones((64, 128, 3)))
    assert found.light.sum(axis=0) == pytest.approx([2 * np.pi] * 3)
    up = (found.light * found.direction[:, 2:]).sum(axis=0)
    assert up == pytest.approx([np.pi] * 3, rel=1e-3)


@pytest.mark.parametrize(
    ("row", "column", "turn_deg", "expected"),
    [
        (0, 0, 0.0, (0, 0, 1)),
        (31, 64, 0.0, (1, 0, 0)),
        (31, 32, 0.0, (0, 1, 0)),
        (31, 64, 90.0, (0, 1, 0)),
    ],
)
def test_where_pixels_are(
    row: int, column: int, turn_deg: float, expected: tuple[float, float, float]
) -> None:
    picture = np.zeros((64, 128, 3))
    picture[row, column] = 1
    found = environment(picture, np.radians(turn_deg))
    (bright,) = np.flatnonzero(found.light[:, 0])
    assert found.direction[bright] == pytest.approx(expected, abs=0.06)


def test_lamps_share_all_of_the_light() -> None:
    found = environment(sky())
    place = 245 * even_directions(40)
    lamps = found.on_lamps(place)
    assert lamps.colour.sum(axis=0) == pytest.approx(found.light.sum(axis=0))
    far = found.far_lights(100)
    assert far.colour.sum(axis=0) == pytest.approx(found.light.sum(axis=0))


def test_one_bright_pixel_gives_one_lamp_each_and_the_far_one_is_there() -> None:
    picture = np.zeros((64, 128, 3))
    picture[20, 50] = (3, 2, 1)
    found = environment(picture)
    lamps = found.on_lamps(245 * even_directions(30))
    assert np.count_nonzero(lamps.colour[:, 0]) == 1
    (lamp,) = np.flatnonzero(lamps.colour[:, 0])
    bright = found.direction[found.light[:, 0] > 0][0]
    assert even_directions(30)[lamp] @ bright == pytest.approx((even_directions(30) @ bright).max())
    far = found.far_lights(30)
    (sun,) = np.flatnonzero(far.colour[:, 0])
    assert unit(far.place[sun]) == pytest.approx(bright)


def test_what_is_below_the_horizon_lights_nothing() -> None:
    picture = np.zeros((64, 128, 3))
    picture[32:] = 1
    assert environment(picture).light.sum() == 0


def test_even_directions_are_spread() -> None:
    direction = even_directions(200)
    assert np.linalg.norm(direction, axis=1) == pytest.approx(np.ones(200))
    assert direction[:, 2].min() > 0
    apart = direction @ direction.T - 2 * np.eye(200)
    nearest = np.arccos(apart.max(axis=1))
    assert nearest.min() > 0.6 * np.sqrt(2 * np.pi / 200)
