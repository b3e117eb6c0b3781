"""Rays with known answers: a real pinhole, and a sphere by another formula."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from tbcad.core.geometry.vectors import unit
from tbcad.errors import InputError
from tbcad.light.datasets.pictures import places, resampled
from tbcad.light.datasets.pinholes import seed_points
from tbcad.light.datasets.virtual_cameras import (
    Crop,
    MirrorId,
    _measured,
    camera_at,
    chosen_mirrors,
    read_crop,
    spread_evenly,
    virtual_cameras,
)
from tbcad.light.simulate.capture.light_field import LightField

RADIUS = 30.0
DIRECTIONS = st.tuples(st.floats(-np.pi, np.pi), st.floats(0.0, np.pi / 2))
DISTANCES = st.floats(60.0, 250.0)


def on_sphere(angles: tuple[float, float]) -> np.ndarray:
    azimuth, elevation = angles
    level = np.cos(elevation)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])


def pinhole_crop(centre: np.ndarray, size: int = 40) -> Crop:
    """What a mirror that had one common point would show: columns from right to left."""
    forward = -unit(centre)
    right = unit(np.cross(forward, [0.3, -0.2, 0.9]))
    down = np.cross(forward, right)
    steps = np.linspace(-1.1, 1.1, size) * RADIUS
    points = -steps[None, :, None] * right + steps[:, None, None] * down
    origin = centre + 5.0 * unit(points - centre)
    colour = np.clip(128 + 3 * np.stack([points @ axis for axis in np.eye(3)], axis=2), 0, 255)
    direction = unit(points - origin)
    miss = np.linalg.norm(np.cross(origin, direction), axis=2)
    every = np.ones(points.shape[:2], dtype=bool)
    return Crop(np.rint(colour).astype(np.uint8), origin, direction, every, miss < RADIUS)


@settings(max_examples=25)
@given(angles=DIRECTIONS, distance=DISTANCES)
def test_rays_of_a_pinhole_give_it_back(angles: tuple[float, float], distance: float) -> None:
    centre = distance * on_sphere(angles)
    crop = pinhole_crop(centre)
    row = _measured(crop, RADIUS)
    assert not isinstance(row, str)
    assert row[:3] == pytest.approx(centre, abs=1e-9)
    assert row[4] == pytest.approx(2.2 * RADIUS / 39, rel=1e-9)  # the pitch that was made
    assert row[5:] == pytest.approx(np.zeros(3), abs=1e-9)
    assert int(row[3]) == crop.meets.sum()


@settings(max_examples=25)
@given(angles=DIRECTIONS, distance=DISTANCES, size=st.integers(16, 90))
def test_the_picture_of_a_pinhole_shows_every_point_where_it_is(
    angles: tuple[float, float], distance: float, size: int
) -> None:
    """Colours are linear in the place of a point: each pixel tells the point that it shows."""
    centre = distance * on_sphere(angles)
    camera = camera_at(centre, 2 * RADIUS, size)
    picture, mask = resampled(pinhole_crop(centre), camera, RADIUS)
    rows, columns = np.nonzero(mask)
    shown = (picture[rows, columns].astype(float) - 128) / 3
    appears = camera.project(shown)
    one_level = np.sqrt(3) / 6 * size / (2 * RADIUS * np.sqrt(1 - (RADIUS / distance) ** 2))
    off = np.linalg.norm(appears - np.stack([columns, rows], axis=1), axis=1)
    assert off.max() < 2.5 * one_level + 1e-6
    circle = np.pi / 4 * size**2
    assert mask.sum() == pytest.approx(circle, abs=4 * size)


@given(angles=DIRECTIONS, distance=DISTANCES)
def test_cameras_look_at_the_middle_upright(angles: tuple[float, float], distance: float) -> None:
    camera = camera_at(distance * on_sphere(angles), 2 * RADIUS, 64)
    assert camera.axes @ camera.axes.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(camera.axes) == pytest.approx(1)
    assert camera.project(np.zeros(3)) == pytest.approx([31.5, 31.5])
    assert camera.axes[0, 2] == pytest.approx(0, abs=1e-6)  # rows are level
    assert camera.axes[1, 2] < 1e-6  # and down is down
    side = np.cross(camera.forward, camera.right)
    tangent = camera.pinhole + RADIUS * (distance**2 - RADIUS**2) ** 0.5 / distance * side
    edge = tangent + camera.forward * (distance**2 - RADIUS**2) / distance
    assert camera.project(edge)[1] == pytest.approx(63.5)


def test_a_sphere_by_another_formula() -> None:
    """The common point by a minimiser, the central error by tracing both rays to both ends."""
    pinhole, centre, radius = np.array([100.0, 5.0, -100.0]), np.array([-9.0, 2.0, 80.0]), 24.0
    aim = centre + np.array([-3.0, 4.0, -23.0])
    across = unit(np.cross(aim - pinhole, [0.0, 1.0, 0.0]))
    steps = np.linspace(-4, 4, 25)
    down = unit(np.cross(aim - pinhole, across))
    targets = aim + steps[None, :, None] * across + steps[:, None, None] * down
    ray = unit(targets - pinhole)
    to_centre = centre - pinhole
    along = ray @ to_centre
    length = along - np.sqrt(radius**2 - to_centre @ to_centre + along**2)
    origin = pinhole + length[..., None] * ray
    normal = (origin - centre) / radius
    direction = ray - 2 * (ray * normal).sum(axis=2, keepdims=True) * normal
    every = np.ones(ray.shape[:2], dtype=bool)
    crop = Crop(np.zeros((*ray.shape[:2], 3), np.uint8), origin, direction, every, every)
    row = _measured(crop, RADIUS)
    assert not isinstance(row, str)

    start, way = origin.reshape(-1, 3), direction.reshape(-1, 3)

    def squares(point: np.ndarray) -> float:
        return float((np.cross(point - start, way) ** 2).sum())

    best = minimize(squares, start.mean(axis=0), method="Powell", options={"xtol": 1e-10})
    assert row[:3] == pytest.approx(best.x, abs=1e-4)
    assert row[5] == pytest.approx(np.sqrt(best.fun / len(start)), rel=1e-6)
    forward = -unit(row[:3])
    worst = 0.0
    for o, d in zip(start, way, strict=True):
        middle, front, back = (
            o + (z - o @ forward) / (d @ forward) * d for z in (0.0, -RADIUS, RADIUS)
        )
        central = unit(middle - row[:3])
        for captured, z in ((front, -RADIUS), (back, RADIUS)):
            ideal = row[:3] + (z - row[:3] @ forward) / (central @ forward) * central
            worst = max(worst, float(np.linalg.norm(captured - ideal)))
    assert row[7] == pytest.approx(worst, rel=1e-9)
    assert worst > 0.01


def test_pixels_outside_the_cell_are_masked() -> None:
    """A corner of the crop is of another mirror: nothing of the picture is made of it."""
    centre = 120 * on_sphere((0.4, 0.7))
    whole = pinhole_crop(centre)
    valid = whole.valid.copy()
    valid[:18, :18] = False
    colour = whole.colour.copy()
    colour[~valid] = 255
    crop = replace(whole, colour=colour, valid=valid, meets=whole.meets & valid)
    camera = camera_at(centre, 2 * RADIUS, 60)
    picture, mask = resampled(crop, camera, RADIUS)
    full, known = resampled(whole, camera, RADIUS)
    assert not (mask & ~known).any()
    assert 0.05 * known.sum() < (known & ~mask).sum() < 0.4 * known.sum()
    assert np.array_equal(picture[mask], full[mask])
    assert not picture[~mask].any()
    place = places(crop, camera)[~valid]
    nearest = np.rint(place[(np.abs(place - 29.5) < 29).all(axis=1)]).astype(int)
    assert not mask[nearest[:, 1], nearest[:, 0]].all()


def test_a_coarse_picture_is_a_mean() -> None:
    """Stripes as wide as a ray vanish in pixels of four rays; single samples would show them."""
    centre = 120 * on_sphere((0.4, 0.7))
    crop = pinhole_crop(centre, 96)
    crop.colour[:, 0::2], crop.colour[:, 1::2] = 0, 200
    picture, mask = resampled(crop, camera_at(centre, 2 * RADIUS, 22), RADIUS)
    inner = picture[6:16, 6:16].astype(float)
    assert mask[6:16, 6:16].all()
    assert np.abs(inner - 100).max() < 40
    assert inner.mean() == pytest.approx(100, abs=3)


def test_seed_points_are_carved_by_dark_background() -> None:
    """A bright disc in all pictures is a ball; dark or bright ones fill the sphere."""
    cameras = [
        camera_at(100 * on_sphere((azimuth, elevation)), 2 * RADIUS, 50)
        for azimuth in np.arange(0, 6.2, 0.7)
        for elevation in (0.1, 0.5, 0.9, 1.3)
    ]
    x, y = np.meshgrid(np.arange(50) - 24.5, np.arange(50) - 24.5)
    mask = np.repeat((np.hypot(x, y) < 25)[None], len(cameras), axis=0)
    disc = np.where(np.hypot(x, y) < 12, 180, 0).astype(np.uint8)
    for level, radius in ((disc, 15.0), (disc * 0, RADIUS), (disc * 0 + 180, RADIUS)):
        pictures = np.repeat(np.repeat(level[None, :, :, None], 3, axis=3), len(cameras), axis=0)
        seeds = seed_points(cameras, pictures, mask, 2 * RADIUS)
        assert np.linalg.norm(seeds.points, axis=1).max() == pytest.approx(radius, rel=0.12)
        assert (seeds.colours == level[25, 25]).all()


def test_too_little_to_be_a_camera(field: LightField) -> None:
    whole = pinhole_crop(120 * on_sphere((0.4, 0.7)))
    for columns, reason in ((slice(20, 24), "fewer than"), (slice(None), "side by side")):
        meets = np.zeros_like(whole.meets)
        meets[20, columns] = whole.meets[20, columns]
        assert reason in str(_measured(replace(whole, meets=meets), RADIUS))
    inside = pinhole_crop(20 * on_sphere((0.4, 0.7)))
    assert "outside the capture sphere" in str(_measured(inside, RADIUS))
    mirror = MirrorId("a", 3)
    field.frames["a"].planes["mirror"][field.frames["a"].planes["mirror"] == 4] += 1000
    try:
        virtual = virtual_cameras(field, [mirror, MirrorId("a", 5)])
        assert virtual.left_out == {"a0004": "no pixels"}
        assert [one.name for one in virtual.mirrors] == ["a0006"]
        assert read_crop(field, mirror) is None
    finally:
        field.frames["a"].planes["mirror"][field.frames["a"].planes["mirror"] == 1004] -= 1000


def test_mirrors_are_chosen_by_name_and_evenly(field: LightField) -> None:
    every = [one.name for one in chosen_mirrors(field, None, 1)]
    assert len(every) == len(set(every)) == len(field)
    camera_a = [one.name for one in chosen_mirrors(field, "a", 1)]
    assert camera_a == [name for name in every if name.startswith("a")]
    few = [one.name for one in chosen_mirrors(field, "b0007, a0002,b0007", 1)]
    assert few == ["a0002", "b0007"]
    third = chosen_mirrors(field, None, 3)
    assert len(third) == -(-len(field) // 3)
    for wrong in ("c", "a9999", "", "a0001,"):
        with pytest.raises(InputError, match="is no virtual camera"):
            chosen_mirrors(field, wrong, 1)


def test_kept_cameras_are_spread_evenly() -> None:
    """No direction is far from all kept ones, none of which are near to each other."""
    u = unit(np.random.default_rng(1).normal(size=(600, 3)))
    kept = u[spread_evenly(u, 60)]
    apart = np.linalg.norm(kept[:, None] - kept, axis=2) + 9 * np.eye(60)
    farthest = np.linalg.norm(u[:, None] - kept, axis=2).min(axis=1).max()
    assert farthest <= apart.min()
    assert len(np.unique(spread_evenly(u, 60))) == 60
