"""Distances to what turns about the axis, against the same in arrays of all points and bodies."""

import numpy as np
import pytest

from tbcad.core.geometry.round_cones import RoundCones
from tbcad.core.geometry.vectors import norm
from tbcad.prototype.keepout import (
    azimuth_ranges,
    cone_table,
    distances_to_balls,
    distances_to_cones,
    lower_to_section,
)
from tbcad.types import Floats

TOLERANCE = 1e-9  # mm
POINTS, BODIES = 500, 12


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


@pytest.fixture
def points(rng: np.random.Generator) -> Floats:
    """Points as z, r and azimuth, some of them inside of bodies."""
    return rng.uniform([-150, 0, -np.pi], [150, 150, np.pi], (POINTS, 3))


@pytest.fixture
def azimuths(rng: np.random.Generator) -> Floats:
    """Ranges, one of them all round."""
    ranges = rng.uniform(-np.pi, 0, (BODIES, 1)) + rng.uniform([0, 0], [0, np.pi], (BODIES, 2))
    ranges[0] = -np.pi, np.pi
    return ranges


def round_cones(rng: np.random.Generator) -> RoundCones:
    """Half of them from a sphere about a point of the axis, as the light at the object is."""
    end = rng.uniform([-150, 60], [150, 100], (BODIES, 2))
    start = rng.uniform([-100, 0], [100, 20], (BODIES, 2))
    start[: BODIES // 2] = 0
    start_radius, end_radius = rng.uniform([[20], [1]], [[30], [10]], (2, BODIES))
    return RoundCones(start, end, start_radius, end_radius)


def from_ranges(points: Floats, azimuths: Floats) -> Floats:
    """Points (n, m, 3) as seen from the nearest half-plane of each range of azimuths (m, 2)."""
    middle, half = azimuths.mean(axis=1), np.diff(azimuths, axis=1)[:, 0] / 2
    from_middle = np.abs((points[:, 2, None] - middle + np.pi) % (2 * np.pi) - np.pi)
    beyond = np.maximum(from_middle - half, 0)
    r = points[:, 1, None]
    z = np.broadcast_to(points[:, 0, None], beyond.shape)
    return np.stack([z, r * np.cos(beyond), r * np.sin(beyond)], axis=-1)


def to_cones(points: Floats, cones: RoundCones) -> Floats:
    """Signed distances (n, m) of points (n, m, 3) to round cones (m,)."""
    flat = np.zeros((len(cones), 1))
    start, end = np.hstack([cones.start, flat]), np.hstack([cones.end, flat])
    length = norm(end - start)
    from_start = points - start
    along = (from_start * ((end - start) / length[:, None])).sum(axis=-1)
    out = np.sqrt(np.maximum((from_start**2).sum(axis=-1) - along**2, 0))
    shrink = (cones.start_radius - cones.end_radius) / length
    foot = np.clip((along - out * shrink / np.sqrt(1 - shrink**2)) / length, 0, 1)
    radius = cones.start_radius + foot * (cones.end_radius - cones.start_radius)
    return np.asarray(np.hypot(along - foot * length, out) - radius)


def to_polygon(points: Floats, polygon: Floats) -> Floats:
    """Distance (n,) of points (n, 2) to a polygon (p, 2), 0 inside."""
    side = np.roll(polygon, -1, axis=0) - polygon
    from_corner = points[:, None] - polygon
    share = np.clip((from_corner * side).sum(axis=-1) / (side**2).sum(axis=-1), 0, 1)
    distance: Floats = norm(from_corner - share[..., None] * side).min(axis=1)
    above = polygon[:, 1] > points[:, 1, None]
    crosses = above != np.roll(above, -1, axis=1)
    rise = np.where(side[:, 1] == 0, 1.0, side[:, 1])
    right = points[:, 0, None] < polygon[:, 0] + from_corner[..., 1] / rise * side[:, 0]
    inside = (crosses & right).sum(axis=1) % 2 == 1
    return np.where(inside, 0.0, distance)


def test_distances_to_cones(rng: np.random.Generator, points: Floats, azimuths: Floats) -> None:
    cones = round_cones(rng)
    expected = to_cones(from_ranges(points, azimuths), cones).min(axis=1)
    found = distances_to_cones(points, cone_table(cones), azimuth_ranges(azimuths))
    assert found == pytest.approx(expected, abs=TOLERANCE)
    assert (found < 0).any()


def test_distances_to_balls(rng: np.random.Generator, points: Floats, azimuths: Floats) -> None:
    centre, radius = rng.uniform([-100, 0], [100, 100], (BODIES, 2)), rng.uniform(1, 30, BODIES)
    balls = np.column_stack([centre, np.zeros(BODIES)])
    expected = (norm(from_ranges(points, azimuths) - balls) - radius).min(axis=1)
    found = distances_to_balls(points, centre, radius, azimuth_ranges(azimuths))
    assert found == pytest.approx(expected, abs=TOLERANCE)


@pytest.mark.parametrize("body", [0, 1])
def test_distances_to_sections(points: Floats, azimuths: Floats, body: int) -> None:
    angle = np.linspace(0, 2 * np.pi, 9)[:-1]
    reach = 30 * (1 + np.arange(8) % 2)  # a star, with corners that point inwards
    polygon = np.column_stack([reach * np.cos(angle), 70 + reach * np.sin(angle)])
    place = from_ranges(points, azimuths[[body]])[:, 0]
    others = np.full(len(points), 60.0)
    expected = np.minimum(np.hypot(to_polygon(place[:, :2], polygon), place[:, 2]), others)
    (turned,) = azimuth_ranges(azimuths[[body]])
    lower_to_section(points, polygon, turned, others)
    assert others == pytest.approx(expected, abs=TOLERANCE)
    assert (others == 0).any()
