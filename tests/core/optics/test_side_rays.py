"""Rays through sides of cells, against the same in arrays."""

import numpy as np
import pytest

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.side_rays import misses_of_balls
from tbcad.types import Floats
from tests.sphere_misses import sphere_miss_distances

SIDES, SAMPLES, MIRRORS = 40, 9, 7
PINHOLE, CAMERA = np.array([100.0, 0.0, -100.0]), np.array([99.0, 1.0, -101.0])
TOLERANCE = 1e-9  # mm


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def sides(rng: np.random.Generator) -> tuple[Floats, Floats, np.ndarray, Floats]:
    """Control points near an apex, weights, mirrors and parameters."""
    points = np.array([-100.0, 0.0, 50.0]) + rng.normal(size=(SIDES, 3, 3)) * 8
    mirror = rng.integers(0, MIRRORS, SIDES)
    return points, rng.uniform(0.5, 1, SIDES), mirror, rng.uniform(0, 1, (SIDES, SAMPLES))


def on_sides(points: Floats, weight: Floats, t: Floats) -> Floats:
    basis = np.stack([(1 - t) ** 2, 2 * t * (1 - t) * weight[:, None], t**2], axis=-1)
    return np.asarray(np.einsum("esk,ekx->esx", basis, points) / basis.sum(axis=-1, keepdims=True))


def test_balls(rng: np.random.Generator) -> None:
    points, weight, mirror, t = sides(rng)
    centre = np.array([-105.0, 0.0, 52.0]) + rng.normal(size=(MIRRORS, 3)) * 3
    radius, axis = rng.uniform(4, 15, MIRRORS), unit(rng.normal(size=(MIRRORS, 3)))
    angle = rng.uniform(-0.05, 0.05, MIRRORS)
    ray = unit(on_sides(points, weight, t) - PINHOLE)
    ray = rotated(ray, axis[mirror][:, None], angle[mirror][:, None])
    expected = sphere_miss_distances(CAMERA, ray, centre[mirror][:, None], radius[mirror][:, None])
    balls = np.column_stack([centre, radius, axis, np.cos(angle), np.sin(angle)])
    pinholes = np.stack([PINHOLE, CAMERA])
    found = misses_of_balls(points, weight, mirror, balls, pinholes, t)
    assert found == pytest.approx(expected, abs=TOLERANCE, rel=TOLERANCE)
    hit = np.isfinite(found).mean()
    assert 0.1 < hit < 0.9
