"""Photographs through a real lens: against Coddington's equations, flat fields, and noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import minimum_filter

from tbcad.core.camera.requirements import image_distances
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.lens import PupilLens
from tbcad.core.optics.reflection import reflection_points, scattered_share
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.capture.real import (
    RealOptics,
    developed,
    mirror_rays,
    mirror_scatter,
    real_photograph,
    with_scatter,
)
from tbcad.light.simulate.capture.sensor import SimulatedSensor
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import PupilPoint, exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Floats

LENS = PupilLens(0.85, 134.6)
OPTICS = RealOptics(LENS, 0.85, np.array([3.5]))
SILENT = replace(OPTICS, sensor=SimulatedSensor(noise=0.0))


@pytest.fixture(scope="module")
def small(cameras: tuple[Reflector, Reflector]) -> Reflector:
    """Few pixels, for whole photographs."""
    one = cameras[0]
    return replace(one, camera=replace(one.camera, width_px=208, height_px=155))


def in_focus(camera: Camera, start: Floats, way: Floats) -> Floats:
    """Where rays from points of the pupil meet the plane in focus, mm, (n, 3)."""
    ahead = LENS.focus_mm - (start - camera.pinhole) @ camera.forward
    return np.asarray(start + (ahead / (way @ camera.forward))[..., None] * way)


@pytest.mark.parametrize("sagittal", [False, True])
def test_spread_is_that_of_coddington(cameras: tuple[Reflector, Reflector], sagittal: bool) -> None:
    """The middle of the object, seen from two points of the pupil, in twelve mirrors.

    The chief ray's astigmatic images, at both of Coddington's distances, say how far apart it is in
    the plane that is in focus.
    """
    camera, mirrors = cameras[0].camera, cameras[0].mirrors
    some = np.linspace(0, len(mirrors) - 1, 12).astype(int)
    centre, radius = mirrors.centre[some], mirrors.radius[some]
    chief = reflection_points(centre, radius, np.zeros(3), camera.pinhole)
    way, normal = unit(chief - camera.pinhole), unit(chief - centre)
    across = unit(np.cross(way, normal))
    axis = across if sagittal else np.cross(across, way)
    flat = unit(axis - (axis @ camera.forward)[:, None] * camera.forward)  # in the pupil's plane
    incidence = np.arccos(-dot(way, normal))
    images = image_distances(1 / radius, incidence, norm(chief))
    depth = norm(chief - camera.pinhole) + np.array(images)  # tangential, sagittal
    found, wanted = [], []
    for sign in (-1, 1):
        start = camera.pinhole + sign * LENS.pupil_mm / 2 * flat
        moved = [
            reflection_points(centre[k : k + 1], radius[k : k + 1], np.zeros(3), start[k])[0]
            for k in range(len(some))
        ]
        found.append(in_focus(camera, start, unit(np.array(moved) - start)))
        aside = start - camera.pinhole
        bent = [
            dot(aside, fan)[:, None] / away[:, None] * fan
            for fan, away in zip((np.cross(across, way), across), depth, strict=True)
        ]
        wanted.append(in_focus(camera, start, unit(way - sum(bent))))
    spread = norm(found[1] - found[0])
    assert norm((found[1] - found[0]) - (wanted[1] - wanted[0])) == pytest.approx(0, abs=0.01)
    assert spread.max() > 0.1  # as far as pixels are apart, and more


def test_rays_of_the_pupil_show_what_they_should(cameras: tuple[Reflector, Reflector]) -> None:
    """A ray through a point of the pupil obeys the law of reflection on its mirror."""
    one = cameras[0]
    point = PupilPoint(np.array([0.3, 0.2, 0.0]), LENS.focus_mm)
    rows = range(150, 160)
    rays = exact_tracer(one, point)(rows, (0.25, -0.25))
    on = rays.mirror > 0
    assert on.mean() > 0.5
    way = point.directions(one.camera, rows, (0.25, -0.25))[on]
    origin, mirror = rays.origin[on], one.mirrors
    away = origin - one.camera.pinhole - point.aside
    assert norm(np.cross(away, way)) == pytest.approx(0, abs=1e-9)
    number = rays.mirror[on] - 1
    normal = unit(origin - mirror.centre[number])
    assert norm(origin - mirror.centre[number]) == pytest.approx(mirror.radius[number])
    assert rays.direction[on] == pytest.approx(way - 2 * dot(way, normal)[:, None] * normal)


def test_a_small_pupil_is_the_pinhole(small: Reflector, knot: Scene) -> None:
    """Without defocus the rays are those of 2 x 2 over the pixel."""
    tiny = replace(OPTICS, ray_share=1e-9)
    for sample, trace in mirror_rays(small, tiny):
        sharp = exact_tracer(small)(range(60, 70), sample.shift)
        rays = trace(range(60, 70), sample.shift)
        assert (rays.mirror == sharp.mirror).mean() > 0.999
        same = (rays.mirror == sharp.mirror) & (rays.mirror > 0)
        assert rays.direction[same] == pytest.approx(sharp.direction[same], abs=1e-6)


def test_even_light_stays_even(small: Reflector) -> None:
    """A grey ball, all alike: kernel, halo, veil and development leave its middle as it was."""
    ball = replace(patterned_ball(29.9), patterned=False, light=None)
    ball = replace(ball, light=np.full((len(ball.points), 2), 0.6))
    scene, optics = prepared_scene(ball), replace(SILENT, roughness_nm=np.array([0.0]))
    colour = np.concatenate([one.colour for one in real_photograph(small, scene, optics)])
    bands = list(photograph(small.camera, exact_tracer(small), scene))
    sharp = np.concatenate([one.colour[..., 0] > 0 for one in bands])
    mirror = np.concatenate([one.rays.mirror > 0 for one in bands])
    inner = minimum_filter(sharp & mirror, 9)  # without mirrors it is brighter
    assert inner.sum() > 50
    assert np.abs(colour[inner].astype(float) - 0.6 * 255).max() < 8
    direct = minimum_filter(sharp & ~mirror, 9)
    assert colour[direct] == pytest.approx(0.6 * 255 / 0.85, abs=8)


def test_veil_of_a_half_white_mirror() -> None:
    """What a mirror scatters takes contrast: half white, half black, (1 - s) is left."""
    light = np.zeros((2, 4, 3), dtype=np.float32)
    light[0] = 200
    mirror = np.full((2, 4), 1, dtype=np.int32)
    share = np.full((2, 4), 0.4)
    veiled = with_scatter(light, mirror, share)
    assert veiled[0] == pytest.approx(160)
    assert veiled[1] == pytest.approx(40)


def test_scatter_is_that_of_the_angle(cameras: tuple[Reflector, Reflector]) -> None:
    shares = mirror_scatter(cameras[0], replace(OPTICS, roughness_nm=np.array([25.0])))
    assert shares[0] == 0
    assert 0.15 < shares[1:].min() < shares[1:].max() < scattered_share(25.0)


def test_noise_is_that_of_the_electrons() -> None:
    """Shot and read noise and steps of a full pixel's 90 %, larger where the lens is darker."""
    light = np.full((200, 200, 3), 127.5, dtype=np.float32)
    for fall in (1.0, 0.4):
        numbers = developed(light, np.full((200, 200), fall), OPTICS, 1).astype(float)
        electrons = 10_000 * 0.9 * 0.5 * fall
        gain = 255 / (10_000 * 0.9 * fall)
        step = 255 / 0.9 / 255 / fall
        wanted = np.sqrt(gain**2 * (electrons + 4**2) + (step**2 + 1) / 12)
        assert numbers.std() == pytest.approx(wanted, rel=0.05)
        assert numbers.mean() == pytest.approx(127.5, abs=0.4)


def test_same_photograph_each_time(small: Reflector, knot: Scene) -> None:
    first, second = (
        np.concatenate([one.colour for one in real_photograph(small, knot, OPTICS)])
        for _ in range(2)
    )
    assert (first == second).all()
