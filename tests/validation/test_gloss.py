"""Highlights of lamps: the mirror's limit in closed form, and the integral over a lamp's face."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.lamp_light import RectangularLamps
from tbcad.core.optics.microfacets import NO_DIELECTRIC
from tbcad.light.simulate.scene.cast_light import lamp_sources
from tbcad.light.simulate.scene.highlights import _highlights
from tbcad.types import Floats

LAMP = RectangularLamps(np.array([[0.0, 100, 60]]), np.array([[0.0, -1, 0]]), 16, 50, 100)
UP = np.array([0.0, 0.0, 1.0])
GLASS = 1.5


def shown(rough: float, normal: Floats, ray: Floats, index: float) -> Floats:
    """Of the origin by the lamp of exitance 1: parts of F0 and of 1 - F0, for rays (k, 3)."""
    face = np.array([[one.place, *one.sides] for one in lamp_sources(LAMP)]).reshape(-1, 9)
    every, one = np.ones((1, 2, len(face)), dtype=np.float32), len(ray)
    spots = np.full((one, 3), 1 / 3), np.zeros((one, 3)), normal, ray
    corners = np.zeros((one, 3), dtype=np.int64)
    surface = corners, corners, np.full(one, rough**4), np.full(one, index)
    return np.asarray(_highlights(spots, surface, every, face))


def test_a_smooth_conductor_shows_the_lamps_own_radiance_times_fresnel() -> None:
    """Within the mirrored lamp all of it, wherever tiles meet; beside it nothing."""
    draw = np.random.default_rng(2).uniform(-1, 1, (40, 2))
    size = np.where(np.arange(40) < 30, 0.98, 1.05)[:, None]
    u, v = (size * draw / np.where(size > 1, np.abs(draw).max(axis=1, keepdims=True), 1)).T
    place = LAMP.places[0] + np.stack([8 * u, 0 * u, 25 * v], axis=1)
    way = unit(place)
    ray = -(2 * (way @ UP)[:, None] * UP - way)
    even, rise = shown(0.005, np.tile(UP, (40, 1)), ray, NO_DIELECTRIC).T
    assert even[:30] == pytest.approx(1, abs=2e-3)
    assert even[30:] == pytest.approx(0, abs=2e-3)
    assert rise[:30] == pytest.approx((1 - way[:30, 2]) ** 5, rel=0.02)  # Schlick's


def integral(rough: float, normal: Floats, ray: Floats) -> float:
    """The same by 100,000 points of its face, of glass: D G F / (4 cos cos) in numpy."""
    x, z = ((np.arange(n) + 0.5) / n * 2 - 1 for n in (180, 560))
    place = LAMP.places[0] + np.stack(np.broadcast_arrays(8 * x[:, None], 0, 25 * z), axis=-1)
    place = place.reshape(-1, 3)
    square = (place**2).sum(axis=1)
    way = place / np.sqrt(square)[:, None]
    half, alpha2 = unit(way - ray), rough**4
    falls, sees, up, along = way @ normal, -ray @ normal, half @ normal, -half @ ray
    spread = alpha2 / np.pi / (up**2 * (alpha2 - 1) + 1) ** 2
    g1 = [2 * c / (c + np.sqrt(alpha2 + (1 - alpha2) * c * c)) for c in (falls, sees)]
    inner = np.sqrt(GLASS**2 - 1 + along**2)
    across = (along - inner) / (along + inner)
    within = (GLASS**2 * along - inner) / (GLASS**2 * along + inner)
    reflected = spread * g1[0] * g1[1] / (4 * sees) * (across**2 + within**2) / 2
    return float((reflected * way[:, 1] / square)[falls > 0].sum() * 16 * 50 / len(place))


@pytest.mark.parametrize("rough", [0.05, 0.1, 0.2, 0.5])
def test_a_lamp_is_seen_as_large_as_it_is(rough: float) -> None:
    draw = np.random.default_rng(3)
    place = LAMP.places[0] + [8, 0, 25] * draw.uniform(-1.2, 1.2, (10, 1)) * np.ones((1, 3))
    way = unit(place)
    normal = unit(way + unit(draw.normal(size=(10, 3)) + np.array([0, 0.5, 2])))
    ray = way - 2 * (way * normal).sum(axis=1, keepdims=True) * normal
    parts = shown(rough, normal, ray, GLASS)
    found = parts @ [0.04, 0.96]
    exact = np.array([integral(rough, *one) for one in zip(normal, ray, strict=True)])
    assert np.sqrt(np.mean((found - exact) ** 2)) < 0.04 * np.sqrt(np.mean(exact**2))
    assert found.mean() == pytest.approx(exact.mean(), rel=0.03)
