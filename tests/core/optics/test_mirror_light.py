"""Light of lamps by mirrors: closed forms of one ball, and the flux that it sends on."""

import numpy as np
import pytest

from tbcad.core.optics.mirror_light import (
    MM2,
    Lamps,
    direct_light,
    light_by_mirrors,
    lit_mirrors,
)
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Floats

LAMP = np.array([100.0, 0.0, 0.0])
RADIUS = 8.0


def balls(radius: float) -> Surfaces:
    """One at the origin, and one so far off that it sends no light to speak of."""
    apex = np.array([[radius, 0, 0], [1e9, 0, 0]])
    return Surfaces(apex, np.array([[1.0, 0, 0]] * 2), np.full(2, 1 / radius))


def lamp(candela: float = 1.0) -> Lamps:
    """Looks at the ball."""
    return Lamps(LAMP[None], np.array([[-1.0, 0, 0]]), np.array([candela]))


def around(size: float) -> tuple[Floats, Floats, Floats]:
    """Points on a sphere round the ball, unit normals inward, and weights that add to its area."""
    cosine, weight = np.polynomial.legendre.leggauss(2000)
    turn = 2 * np.pi * (np.arange(4) + 0.5) / 4
    x, angle = (one.ravel() for one in np.meshgrid(cosine, turn, indexing="ij"))
    sine = np.sqrt(1 - x**2)
    out = np.stack([x, sine * np.cos(angle), sine * np.sin(angle)], axis=1)
    return size * out, -out, np.repeat(weight, 4) * 2 * np.pi / 4 * size**2


def test_a_small_ball_gives_r_squared_over_four_squares_of_distances() -> None:
    radius, place = 0.01, np.array([[0.0, 80.0, 0.0]])
    mirrors = lit_mirrors(balls(radius), 1.0, -1e3)
    found = light_by_mirrors(lamp(), mirrors, place, -place / 80)
    assert found == pytest.approx(MM2 * radius**2 / (4 * 100**2 * 80**2), rel=1e-3)


def test_a_ball_sends_on_all_light_that_meets_it() -> None:
    places, normals, area = around(60.0)
    mirrors = lit_mirrors(balls(RADIUS), 0.0, -1e3)
    flux = (light_by_mirrors(lamp(), mirrors, places, normals) * area).sum() / MM2
    # Of a Lambertian lamp that looks at it: pi I sin^2 of the half angle that the ball fills.
    assert flux == pytest.approx(np.pi * (RADIUS / 100) ** 2, rel=2e-3)


@pytest.mark.parametrize(("side", "foot"), [(-1.0, -1e3), (1.0, 5.0)])
def test_beyond_its_side_and_below_its_foot_a_mirror_reflects_nothing(
    side: float, foot: float
) -> None:
    place = np.array([[0.0, 80.0, 0.0]])
    mirrors = lit_mirrors(balls(RADIUS), side, foot)
    assert light_by_mirrors(lamp(), mirrors, place, -place / 80) == 0


def test_what_another_sphere_covers_reflects_nothing() -> None:
    place = np.array([[0.0, 80.0, 0.0]])
    free, covered = balls(RADIUS), balls(RADIUS)
    covered.apex[1] = [30.0, 0, 0]  # of a sphere of 30 mm radius about the same point
    covered.curvature[1] = 1 / 30
    alone = light_by_mirrors(lamp(), lit_mirrors(free, 0.0, -1e3), place, -place / 80)
    both = light_by_mirrors(lamp(), lit_mirrors(covered, 0.0, -1e3), place, -place / 80)
    large = MM2 * light_of_one(30.0)
    assert both == pytest.approx(large, rel=1e-6)
    assert both > 5 * alone


def light_of_one(radius: float) -> float:
    """Of a ball of a radius alone, lux by 1e6."""
    place = np.array([[0.0, 80.0, 0.0]])
    mirrors = lit_mirrors(balls(radius), 0.0, -1e3)
    return float(light_by_mirrors(lamp(), mirrors, place, -place / 80)[0] / MM2)


def test_an_object_stands_in_its_own_light() -> None:
    place = np.array([[0.0, 80.0, 0.0]])
    mirrors = lit_mirrors(balls(RADIUS), 0.0, -1e3)
    assert light_by_mirrors(lamp(), mirrors, place, -place / 80, 20.0) == 0


def test_direct_light_is_that_of_lamberts_law() -> None:
    normals = np.array([[1.0, 0, 0], [0.6, 0.8, 0], [-1.0, 0, 0]])
    found = direct_light(lamp(5.0), np.zeros((3, 3)), normals)
    assert found == pytest.approx(MM2 * 5 / 100**2 * np.array([1, 0.6, 0]))
