"""A photograph through a wide lens off a camera's mirrors, rendered by Mitsuba as well.

Mirrors are its exact spheres, the lens its thin lens: defocus, astigmatism and pixels that show two
mirrors, without diffraction, which a pupil as wide as this has none of.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import minimum_filter

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.lens import PupilLens
from tbcad.light.simulate.capture import real
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector, reflectors
from tbcad.types import Bools, Floats

pytestmark = pytest.mark.clients

RADIUS, SAMPLES, FINE = 20.0, 144, 6
LENS = PupilLens(8.0, 134.6)
ROWS = range(150, 214)


def rendered(mi: Any, one: Reflector) -> Floats:
    """A ball that shines evenly, 0 to 1, (h, w)."""
    camera, mirrors = one.camera, one.mirrors
    ahead, up = camera.pinhole + camera.forward, -camera.axes[1]
    to_world = mi.ScalarTransform4f().look_at(camera.pinhole.tolist(), ahead.tolist(), up.tolist())
    spheres = {
        f"mirror_{k}": {
            "type": "sphere",
            "center": centre.tolist(),
            "radius": float(radius),
            "bsdf": {"type": "conductor", "material": "none"},
        }
        for k, (centre, radius) in enumerate(zip(mirrors.centre, mirrors.radius, strict=True))
    }
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


def test_a_wide_lens_blurs_as_in_mitsuba(
    low_resolution_design: MirrorDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    one, ball = reflectors(low_resolution_design)[0], patterned_ball(RADIUS)
    even = np.ones((len(ball.points), 2))
    scene = prepared_scene(replace(ball, patterned=False, light=even))
    monkeypatch.setattr(real, "pupil_points", in_disc)

    def light(share: float) -> tuple[Floats, Bools]:
        optics = real.RealOptics(LENS, 1.0, np.zeros(1), ray_share=share, fine=FINE)
        through = real.mirror_rays(one, optics)
        rays, found = real._band(one.camera, exact_tracer(one), through, scene, optics, ROWS)
        return found[..., 0] / 255, rays[0] > 0

    (ours, mirror), (pinhole, _) = light(1.0), light(1e-9)
    theirs = rendered(mi, one)
    inner = minimum_filter(mirror, 13)  # their spheres go on beyond seam and foot
    blurred = inner & (theirs > 0.1) & (theirs < 0.9)
    apart, without = (np.sqrt(np.mean((a - theirs)[blurred] ** 2)) for a in (ours, pinhole))
    assert blurred.sum() > 1000
    assert abs((ours - theirs)[inner].mean()) < 0.002
    assert apart < 0.05  # of 144 and of 36 rays that meet the ball or not
    assert without > 3 * apart
