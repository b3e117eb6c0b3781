"""Rays of a light field: where they enter the capture sphere, and what their pixels cover."""

import numpy as np
import pytest

from tbcad.core.optics.camera import Camera
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.reconstruction.rays import CapturedRays, captured_rays, entries, noise_level
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField
from tests.ray_fields import RADIUS, lines

PINHOLES = np.array([[0.0, 3.0, 50.0], [40.0, -5.0, 20.0]])
PITCH = 0.004  # of a pixel at unit distance
SIDE = 20  # pixels of a mirror


def frame(shift: int = 0) -> CameraFrame:
    """Two virtual pinhole cameras side by side that look at the origin, in one picture."""
    origin, direction = np.zeros((2, SIDE, 2 * SIDE, 3), np.float32)
    mirror = np.zeros((SIDE, 2 * SIDE), np.uint16)
    steps = (np.arange(SIDE) - (SIDE - 1) / 2) * PITCH
    for k, pinhole in enumerate(PINHOLES):
        forward, right, down = axes(k)
        ways = forward + steps[None, :, None] * right + steps[:, None, None] * down
        here = slice(k * SIDE, (k + 1) * SIDE)
        direction[:, here] = ways / np.linalg.norm(ways, axis=2, keepdims=True)
        origin[:, here] = pinhole
        mirror[:, here] = k + 1
    mirror[0, 0] = 0
    colour = np.zeros((SIDE, 2 * SIDE, 3), np.uint8)
    colour[..., 0] = np.arange(2 * SIDE) + shift
    planes = {"colour": colour, "mirror": mirror, "origin": origin, "direction": direction}
    camera = Camera(np.zeros(3), np.array([0, 0, 1.0]), np.array([1.0, 0, 0]), 2 * SIDE, SIDE, 0.5)
    mirrors = Surfaces(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(2))
    return CameraFrame(camera, PINHOLES, mirrors, np.zeros((2, 4), np.int64), planes)


def axes(k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    forward = -PINHOLES[k] / np.linalg.norm(PINHOLES[k])
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    return forward, right, np.cross(forward, right)


def captured(footprint: bool = False) -> CapturedRays:
    return captured_rays(LightField({"a": frame(), "b": frame(100)}, 2 * RADIUS, {}), footprint)


def test_rays_enter_the_sphere_in_closed_form() -> None:
    points, direction = lines(500, 4)
    origin = points - 7.5 * direction
    entry, length = entries(origin, direction, RADIUS)
    assert entry == pytest.approx(points, abs=1e-4)
    assert length == pytest.approx(-2 * (points * direction).sum(axis=1), abs=1e-4)


def test_rays_beside_and_away_from_the_sphere_miss_it_and_from_inside_go_on() -> None:
    origin = np.array([[0.0, 11, -20], [0, 0, 20], [0, 0, -20], [0, 0, 4]])
    entry, length = entries(origin, np.tile([0.0, 0, 1], (4, 1)), RADIUS)
    assert length == pytest.approx([0, 0, 2 * RADIUS, 6])
    assert entry[3] == pytest.approx(origin[3])


def test_each_pixel_of_a_mirror_is_a_ray_with_its_colour() -> None:
    rays = captured()
    assert len(rays) == 2 * (2 * SIDE * SIDE - 1)
    assert np.array_equal(np.unique(rays.mirror), [0, 1, 2, 3])
    pixel = np.flatnonzero(rays.mirror == 2)[0]
    assert rays.colour[pixel] == pytest.approx([101 / 255, 0, 0])
    away = rays.entry - PINHOLES[rays.mirror % 2]
    assert np.cross(away, rays.direction) == pytest.approx(0, abs=1e-4)
    assert np.linalg.norm(rays.entry, axis=1) == pytest.approx(RADIUS, abs=1e-4)


@pytest.mark.parametrize("k", [0, 1])
def test_the_footprint_of_a_pinhole_is_its_step(k: int) -> None:
    rays = captured(footprint=True)
    assert np.abs(rays.footprint[:, 2:]).max() < 1.1 * PITCH  # also where another mirror is next
    middle = np.argmax(np.where(rays.mirror == k, rays.direction @ axes(k)[0], -1))
    right, down = rays.footprint[middle, 2:]
    _, along, across = axes(k)
    assert right == pytest.approx(PITCH * along, abs=2e-5)
    assert down == pytest.approx(PITCH * across, abs=2e-5)
    distance = np.linalg.norm(PINHOLES[k]) - RADIUS
    assert rays.footprint[middle, 0] == pytest.approx(distance * PITCH * along, abs=3e-3)
    assert rays.footprint[middle, 1] == pytest.approx(distance * PITCH * across, abs=3e-3)


def test_light_fields_that_look_past_the_object_are_refused() -> None:
    beside = frame()
    beside.planes["origin"][...] += np.float32(1000)
    with pytest.raises(InputError, match="capture sphere"):
        captured_rays(LightField({"a": beside}, 2 * RADIUS, {}))


@pytest.mark.parametrize(("offset", "noise"), [(0.0, 0.0), (0.0, 0.01), (0.08, 0.01)])
@pytest.mark.parametrize("lit", [0.0, 0.2])
def test_noise_reaches_the_level_that_the_background_shows(
    offset: float, noise: float, lit: float
) -> None:
    """Though light falls on some of what should be dark."""
    rng = np.random.default_rng(0)
    background = np.clip(offset + noise * rng.normal(size=(20_000, 3)), 0, 1).max(axis=1)
    dark = background.copy()
    background[: round(lit * len(dark))] += 0.3
    level = noise_level(background.astype(np.float32))
    assert offset - 1e-6 <= level <= offset + 7 * noise
    assert (dark <= level).mean() > (0.9 if lit else 0.98)


def test_background_that_noise_explains_is_black_and_the_rest_as_photographed() -> None:
    rng = np.random.default_rng(1)
    seen = frame()
    shape = seen.planes["colour"].shape
    seen.planes["colour"][...] = rng.integers(0, 4, shape)
    seen.planes["colour"][8:12, 8:12] = (90, 40, 200)
    outside = LightField({"a": seen}, 2 * 1.5, {})  # most rays pass a small capture sphere
    rays = captured_rays(outside)
    bright = rays.colour.max(axis=1) > 0
    assert 0 < bright.sum() < len(rays)
    assert np.unique(rays.colour[bright] * 255, axis=0) == pytest.approx(
        np.array([[90, 40, 200]]), abs=1e-4
    )


def test_an_object_that_fills_the_capture_sphere_is_no_background() -> None:
    """What is next to it is: the noise is that of rays past the sphere."""
    seen = frame()
    _, length = entries(seen.planes["origin"], seen.planes["direction"], 1.5)
    seen.planes["colour"][...] = np.where(length > 0, 80, 0)[..., None]
    rays = captured_rays(LightField({"a": seen}, 2 * 1.5, {}))
    assert rays.dark_level() < rays.colour.min()
