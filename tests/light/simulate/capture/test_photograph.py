"""Photographs: what each pixel sees, of one ray or of many, and what hides what."""

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.capture.light_field import PIXEL_ARRAYS, LightField, traced_light_field
from tbcad.light.simulate.capture.photograph import photograph, subpixel_shifts
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.studies.low_pass import defocus_shifts, low_pass_shifts

Cameras = tuple[Reflector, Reflector]


def picture(
    at: Reflector, scene: Scene, samples: int | tuple[tuple[float, float], ...] = 1
) -> tuple[np.ndarray, np.ndarray]:
    bands = list(photograph(at.camera, exact_tracer(at), scene, samples))
    return (
        np.concatenate([band.colour for band in bands]),
        np.concatenate([band.rays.mirror for band in bands]),
    )


def test_a_pixel_sees_what_its_ray_sees(cameras: Cameras, knot: Scene) -> None:
    at = cameras[0]
    colour, mirror = picture(at, knot)
    rays = exact_tracer(at)(range(at.camera.height_px), (0.0, 0.0))
    seen = cast_rays(knot, rays.origin.reshape(-1, 3), rays.direction.reshape(-1, 3))
    on = mirror.ravel() > 0
    assert np.array_equal(np.rint(seen.colour[on]), colour.reshape(-1, 3)[on])
    assert colour.reshape(-1, 3)[on].any(axis=1).sum() > 1000


def test_the_object_hides_what_is_behind_it(cameras: Cameras, knot: Scene) -> None:
    """Where the camera sees the object directly there is a colour and no mirror's ray."""
    at = cameras[0]
    colour, mirror = picture(at, knot)
    direct = colour.any(axis=2) & (mirror == 0)
    assert direct.sum() > 100
    middle = np.argwhere(direct).mean(axis=0)
    # The middle of the object appears where the camera sees the origin, above the seam.
    assert abs(middle[1] - at.camera.project(np.zeros(3))[0]) < 5
    assert middle[0] < at.camera.height_px / 4


def test_anti_aliasing_is_the_mean_of_finer_pixels(cameras: Cameras, knot: Scene) -> None:
    at = cameras[1]
    fine = [picture(at, knot, (shift,))[0].astype(float) for shift in subpixel_shifts(2)]
    smooth, mirror = picture(at, knot, 2)
    assert np.array_equal(picture(at, knot, tuple(subpixel_shifts(2)))[0], smooth)
    on = mirror > 0
    assert np.abs(smooth - np.mean(fine, axis=0))[on].max() <= 1.0
    plain, same = picture(at, knot)
    assert np.array_equal(mirror, same)  # rays are those of the pixels' centres
    assert not np.array_equal(plain, smooth)


def contrast(shifts: tuple[tuple[float, float], ...], frequency: float) -> float:
    """What is left of a sine along the rows, cycles a pixel."""
    x = np.array(shifts)[:, 0]
    return float(np.abs(np.exp(2j * np.pi * frequency * x).mean()))


@pytest.mark.parametrize("separation", [0.75, 1.0, 2.0])
@pytest.mark.parametrize("frequency", [0.1, 0.25, 0.4])
def test_low_pass_filter_passes_its_cosine(separation: float, frequency: float) -> None:
    """|cos(pi s f)|, times the pixel's own response."""
    pixel = contrast(tuple(subpixel_shifts(3)), frequency)
    expected = abs(np.cos(np.pi * separation * frequency)) * pixel
    assert contrast(low_pass_shifts(separation, 3), frequency) == pytest.approx(expected, abs=1e-12)


def test_defocus_fills_its_circle() -> None:
    """Radius of gyration: that of the circle and of the pixel, d^2 / 8 + 1 / 6."""
    places = np.array(defocus_shifts(6.0, 400))
    assert np.abs(places.mean(axis=0)).max() < 0.02
    assert (places**2).sum(axis=1).mean() == pytest.approx(36 / 8 + 1 / 6, rel=0.01)


def test_every_part_is_that_of_the_photograph(
    low_resolution_design: MirrorDesign, knot: Scene, light_field: LightField
) -> None:
    traced = traced_light_field(low_resolution_design, knot)
    assert traced.capture_mm == light_field.capture_mm
    for name, frame in light_field.frames.items():
        rows, columns = frame.planes["mirror"].shape
        parts = [np.s_[:rows, :columns], np.s_[rows // 3 : rows // 2, 7 : columns // 2]]
        for part in parts + [np.s_[box[2] : box[3], box[0] : box[1]] for box in frame.boxes[::40]]:
            expected, got = frame.read(*part), traced.frames[name].read(*part)
            for plane in PIXEL_ARRAYS:
                assert np.array_equal(got[plane], expected[plane]), plane
                assert got[plane].dtype == expected[plane].dtype
