"""A photograph through a wide lens off a camera's mirrors, rendered by Mitsuba as well.

Mirrors are its exact spheres, the lens its thin lens: defocus, astigmatism and pixels that show two
mirrors, without diffraction, which a pupil as wide as this has none of.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.ndimage import minimum_filter
from scipy.optimize import curve_fit
from scipy.special import ndtr

from tbcad.core.camera.requirements import image_distances
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.lens import PupilLens
from tbcad.core.optics.reflection import reflection_points
from tbcad.light.simulate.capture import real
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector, reflectors
from tbcad.types import Floats, Ints
from tests.clients.real_machine import mitsuba_mirrors

pytestmark = pytest.mark.clients

RADIUS, SAMPLES, FINE = 20.0, 144, 6
LENS = PupilLens(8.0, 134.6)
ROWS = range(150, 214)
EDGE_PX, WIDE_PX = 5, 0.3  # reach of an edge; spreads that are compared


def rendered(mi: Any, one: Reflector) -> Floats:
    """A ball that shines evenly, 0 to 1, (h, w)."""
    camera = one.camera
    ahead, up = camera.pinhole + camera.forward, -camera.axes[1]
    to_world = mi.ScalarTransform4f().look_at(camera.pinhole.tolist(), ahead.tolist(), up.tolist())
    spheres = mitsuba_mirrors(one.mirrors)
    film = {"width": camera.width_px, "height": camera.height_px, "rfilter": {"type": "box"}}
    film |= {"crop_offset_y": ROWS.start, "crop_height": len(ROWS)}
    film |= {"crop_offset_x": 0, "crop_width": camera.width_px}
    sensor = {
        "type": "thinlens",
        "aperture_radius": LENS.pupil_mm / 2,
        "focus_distance": LENS.focus_mm,
        "fov": float(np.degrees(camera.hfov)),
        "near_clip": 1.0,
        "far_clip": 1e4,
        "to_world": to_world,
        "film": {"type": "hdrfilm", "component_format": "float32", **film},
        "sampler": {"type": "stratified", "sample_count": SAMPLES},
    }
    ball = {"type": "sphere", "radius": RADIUS, "emitter": {"type": "area", "radiance": 1.0}}
    integrator = {"type": "path", "max_depth": 2, "rr_depth": 100}
    scene = {"type": "scene", "integrator": integrator, "sensor": sensor, "ball": ball, **spheres}
    return np.asarray(np.array(mi.render(mi.load_dict(scene), seed=1))[..., 0])


def in_disc(fine: int) -> Floats:
    """Points of a disc in no order: as many as a pixel's rays."""
    k = np.arange(fine**2)
    away, turn = np.sqrt((k + 0.5) / len(k)), np.pi * (3 - np.sqrt(5)) * k
    points = np.column_stack([away * np.cos(turn), away * np.sin(turn)])
    return np.asarray(np.random.default_rng(3).permutation(points).reshape(fine, fine, 2))


class Pictures(NamedTuple):
    """An evenly bright ball, 0 to 1, and the mirror of each pixel, (h, w)."""

    ours: Floats
    pinhole: Floats  # without a pupil
    theirs: Floats
    mirror: Ints
    reflector: Reflector


@pytest.fixture(scope="module")
def pictures(low_resolution_design: MirrorDesign) -> Pictures:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    one, ball = reflectors(low_resolution_design)[0], patterned_ball(RADIUS)
    even = np.ones((len(ball.points), 2))
    scene = prepared_scene(replace(ball, patterned=False, light=even))

    def light(share: float) -> tuple[Floats, Ints]:
        optics = real.RealOptics(LENS, 1.0, np.zeros(1), ray_share=share, fine=FINE)
        through = real.mirror_rays(one, optics)
        rays, found = real._band(one.camera, exact_tracer(one), through, scene, optics, ROWS)
        return found[..., 0] / 255, rays[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(real, "pupil_points", in_disc)
        (ours, mirror), (pinhole, _) = light(1.0), light(1e-9)
    return Pictures(ours, pinhole, rendered(mi, one), mirror, one)


def test_a_wide_lens_blurs_as_in_mitsuba(pictures: Pictures) -> None:
    ours, pinhole, theirs, mirror, _ = pictures
    inner = minimum_filter(mirror > 0, 13)  # their spheres go on beyond seam and foot
    blurred = inner & (theirs > 0.1) & (theirs < 0.9)
    apart, without = (np.sqrt(np.mean((a - theirs)[blurred] ** 2)) for a in (ours, pinhole))
    assert blurred.sum() > 1000
    assert abs((ours - theirs)[inner].mean()) < 0.002
    assert apart < 0.05  # of 144 and of 36 rays that meet the ball or not
    assert without > 3 * apart


def blur_of(one: Reflector, number: int) -> Floats:
    """Pixels (2, 2) by which the middle of the ball is off, for each mm beside the pupil's middle.

    By Coddington's equations for the chief ray off a mirror.
    """
    camera, centre = one.camera, one.mirrors.centre[number - 1]
    radius = one.mirrors.radius[[number - 1]]
    chief = reflection_points(centre[None], radius, np.zeros(3), camera.pinhole)[0]
    way, normal = unit(chief - camera.pinhole), unit(chief - centre)
    across = unit(np.cross(way, normal))
    incidence = np.arccos(-way @ normal)
    images = image_distances(1 / radius, np.array([incidence]), np.array([norm(chief)]))
    depth = norm(chief - camera.pinhole) + np.ravel(images)  # tangential, sagittal

    def pixel(aside: Floats) -> Floats:
        fans = zip((np.cross(across, way), across), depth, strict=True)
        bent = unit(way - sum(aside @ fan / away * fan for fan, away in fans))
        ahead = LENS.focus_mm / (bent @ camera.forward)
        return np.asarray(camera.project((camera.pinhole + aside + ahead * bent)[None])[0])

    return np.stack([pixel(axis) - pixel(0 * axis) for axis in camera.axes[:2]], axis=1)


def edge_sigma(picture: Floats, place: Floats, rim: tuple[Floats, Floats, Floats]) -> float:
    """Width of the ball's edge toward a direction (2,) of pixels, as that of a normal blur.

    At places (k, 2) of pixels; rim: middle (2,), matrix (2, 2) of its ellipse, and the direction.
    """
    middle, ellipse, way = rim
    away = place - middle
    rho = np.sqrt(np.einsum("ki,ij,kj->k", away, ellipse, away)) + 1e-9
    slope = away @ ellipse / rho[:, None]
    beside = (rho - 1) / norm(slope)
    at = (np.abs(slope @ way) > 0.87 * norm(slope)) & (
        np.abs(beside) < EDGE_PX
    )  # within 30 degrees
    light = picture[tuple(place[at].astype(int).T)]

    def edge(s: Floats, shift: float, sigma: float) -> Floats:
        return np.asarray(ndtr(-(s - shift) / sigma))

    return abs(float(curve_fit(edge, beside[at], light, p0=(0.0, 1.0))[0][1]))


def test_knife_edge_in_twelve_mirrors(pictures: Pictures) -> None:
    """The ball's edge, along both axes of each mirror's blur: ours, theirs, Coddington's."""
    found = []
    for number in np.unique(pictures.mirror[pictures.mirror > 0]):
        place = np.argwhere(pictures.mirror == number)
        light = pictures.pinhole[pictures.mirror == number]
        low, high = place.min(axis=0), place.max(axis=0)
        lit = place[light > 0.5]
        if len(lit) < 100 or (lit - low).min() < EDGE_PX or (high - lit).min() < EDGE_PX:
            continue  # cut off by rows, or by the mirror's own edge
        middle = np.average(place, axis=0, weights=light)
        away = place - middle
        spread = np.einsum("k,ki,kj->ij", light, away, away) / light.sum()
        ellipse = np.linalg.inv(4 * spread)
        blur = blur_of(pictures.reflector, int(number))[::-1]  # by row and column
        variance, axes = np.linalg.eigh(blur @ blur.T * (LENS.pupil_mm / 4) ** 2)
        for expected, way in zip(np.sqrt(variance), axes.T, strict=True):
            rim = middle, ellipse, way
            ours, sharp, theirs = (edge_sigma(one, place, rim) for one in pictures[:3])
            pure = [np.sqrt(max(one**2 - sharp**2, 0)) for one in (ours, theirs)]
            found.append([*pure, expected])
    ours, theirs, expected = np.array(found).T
    wide = expected > WIDE_PX
    assert wide.sum() >= 24
    assert (ours / theirs)[wide].mean() == pytest.approx(1, abs=0.03)
    assert np.abs(ours / theirs - 1)[wide].mean() < 0.07
    assert (ours / expected)[wide].mean() == pytest.approx(1, abs=0.07)  # a disc is no normal blur
