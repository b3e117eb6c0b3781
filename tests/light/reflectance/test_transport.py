"""Light adds up: the reflectance field against captures in the light of all lamps at once."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.light.reflectance.transport import open_reflectance, seen_spots
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.scene.lamps import PointLights, Spots, received_light
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Floats

UP = np.array([0.0, 0.0, 1.0])


def plate_scene(z: float, half: float) -> Scene:
    """A square across z."""
    points = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    grey = np.full((2, 3, 3), 0.5)
    return prepared_scene(SceneObject("plate", points, faces, np.tile(UP, (4, 1)), grey))


def spots_at(*places: tuple[float, float, float]) -> Spots:
    up = np.tile(UP, (len(places), 1))
    return Spots(np.array(places), up, up)


def test_light_is_after_lambert_and_the_square_of_the_distance() -> None:
    lamp = np.array([0.0, 30.0, 40.0])
    found = received_light(plate_scene(0, 50).embree, spots_at((0, 0, 0), (0, 30, 0)), lamp)
    assert found == pytest.approx([0.8, (50 / 40) ** 2])


def test_shadows_and_backs_are_dark() -> None:
    scene = plate_scene(5.0, 4.0)
    lamp = np.array([0.0, 0.0, 100.0])
    found = received_light(scene.embree, spots_at((0, 0, 0), (3.7, 0, 0), (4.4, 0, 0)), lamp)
    assert (found > 0).tolist() == [False, False, True]
    assert received_light(scene.embree, spots_at((9, 0, 0)), -lamp) == pytest.approx([0.0])


def test_the_sum_of_the_lamps_is_one_capture_with_all(
    captured: Path, scene: Scene, field: LightField, cameras: tuple[Reflector, Reflector]
) -> None:
    colour = np.array([[0.3, 0.1, 0.2], [0.1, 0.4, 0.0], [0.2, 0.2, 0.5]])
    with open_reflectance(captured) as reflectance:
        lights = PointLights(reflectance.lamps.place, colour)
        for camera in cameras:
            name = camera.camera_id
            bands = photograph(camera.camera, exact_tracer(camera), lit(scene, lights))
            whole = np.concatenate([band.colour for band in bands]).reshape(-1, 3)
            summed = np.zeros_like(whole, dtype=np.float32)
            summed[reflectance.pixel[name]] = 255 * reflectance.lit(name, colour)
            rays = field.frames[name].planes["mirror"].ravel() > 0
            apart = np.abs(whole.astype(float) - summed)[rays].max(axis=1)
            assert whole[rays].max() > 100
            # Rounded to whole numbers; float32 rays at an edge or a shadow's edge fall beside it.
            assert np.mean(apart > 0.6) < 2e-3


def lit(scene: Scene, lights: PointLights) -> Scene:
    return Scene(scene.subject, scene.embree, scene.shade, scene.radius, lamps=lights)


def test_rays_that_meet_nothing_are_left_out(
    captured: Path, scene: Scene, field: LightField
) -> None:
    with open_reflectance(captured) as reflectance:
        for name, frame in field.frames.items():
            pixel = reflectance.pixel[name]
            assert (np.diff(pixel) > 0).all()
            black = frame.planes["colour"].reshape(-1, 3)[pixel].max(axis=1) == 0
            assert not black.any()
            seen = seen_spots(frame, scene)
            assert np.array_equal(seen.pixel, pixel)
            origin, direction = (
                frame.planes[key].reshape(-1, 3)[pixel].astype(float)
                for key in ("origin", "direction")
            )
            assert off_ray(seen.spots.place, origin, direction).max() < 1e-3


def off_ray(point: Floats, origin: Floats, direction: Floats) -> Floats:
    return np.asarray(np.linalg.norm(np.cross(point - origin, direction), axis=1))
