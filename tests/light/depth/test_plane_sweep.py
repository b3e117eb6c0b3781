"""Depth by a plane sweep: surfaces whose depth is known in closed form."""

import numpy as np
import pytest

from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.pictures import PinholePictures
from tbcad.light.datasets.virtual_cameras import camera_at
from tbcad.light.depth.plane_sweep import swept_depth
from tbcad.light.simulate.scene.rays import camera_around_object, unit_directions
from tbcad.types import Floats

CAPTURE_MM, SIZE_PX, REACH_MM = 60.0, 60, 250.0
VIEW = camera_around_object(0.3, 0.6, 640.0, CAPTURE_MM, (80, 60))


def texture(points: Floats) -> Floats:
    """Colours (..., 3) that change within some mm in all directions."""
    waves = np.array([[0.9, 0.3, 0.2], [-0.2, 0.8, 0.5], [0.4, -0.5, 0.9]])
    return np.asarray(128 + 100 * np.sin(points @ waves.T))


def pictures_of(depth: float, bend: float = 0.0) -> PinholePictures:
    """Cameras around the view's direction that see a textured plane, or a sphere, of some depth.

    Args:
        depth: of the plane behind the one through the origin that faces the view, or of the point
            of the sphere that is nearest to the view, mm.
        bend: curvature of the sphere, 1/mm.
    """
    rng = np.random.default_rng(4)
    toward = -VIEW.forward + 0.3 * rng.uniform(-1, 1, (150, 3))
    centres = REACH_MM * toward / np.linalg.norm(toward, axis=1)[:, None]
    cameras = [camera_at(centre, CAPTURE_MM, SIZE_PX) for centre in centres]
    picture = np.stack([np.rint(texture(met(camera, depth, bend))) for camera in cameras])
    return PinholePictures(
        centres,
        np.stack([camera.axes for camera in cameras]),
        np.array([1 / camera.pixel_pitch for camera in cameras]),
        picture.astype(np.uint8),
        np.ones(picture.shape[:3], dtype=bool),
        CAPTURE_MM,
    )


def met(camera: Camera, depth: float, bend: float) -> Floats:
    """Where the rays of all pixels meet the surface, (h, w, 3)."""
    ray = unit_directions(camera, range(camera.height_px))
    start = camera.pinhole - depth * VIEW.forward
    if bend == 0:
        distance = -(start @ VIEW.forward) / (ray @ VIEW.forward)
        return np.asarray(camera.pinhole + distance[..., None] * ray)
    offset = start - VIEW.forward / bend
    half, rest = ray @ offset, offset @ offset - 1 / bend**2
    root = half**2 - rest
    distance = np.where(root > 0, -half - np.sqrt(np.maximum(root, 0)), 0)
    return np.asarray(camera.pinhole + distance[..., None] * ray)


@pytest.mark.parametrize("depth", [-12.0, 0.0, 9.3])
def test_a_plane(depth: float) -> None:
    found, confidence = swept_depth(pictures_of(depth), VIEW)
    middle = np.s_[18:42, 24:56]
    assert np.abs(found[middle] - depth).max() < 1.0
    assert np.median(np.abs(found[middle] - depth)) < 0.3
    assert confidence[middle].min() > 3


def test_a_sphere() -> None:
    radius = 25.0
    found, _ = swept_depth(pictures_of(-radius, 1 / radius), VIEW)
    x, y = np.meshgrid(np.arange(80) - 39.5, np.arange(60) - 29.5)
    expected = met(VIEW, -radius, 1 / radius) @ VIEW.forward
    middle = np.hypot(x, y) < 15
    assert np.median(np.abs(found - expected)[middle]) < 0.6
    assert np.abs(found - expected)[middle].max() < 3


def test_what_has_no_texture_is_not_known() -> None:
    pictures = pictures_of(0.0)
    pictures.picture[...] = 90
    _, confidence = swept_depth(pictures, VIEW)
    assert confidence.max() < 1e-3


def test_rays_that_pass_the_capture_sphere_have_no_depth() -> None:
    found, confidence = swept_depth(pictures_of(0.0), VIEW)
    ray = unit_directions(VIEW, range(60))
    passes = np.linalg.norm(np.cross(VIEW.pinhole, ray), axis=2) > CAPTURE_MM / 2 + 0.5
    assert passes.any()
    assert np.isnan(found[passes]).all()
    assert (confidence[passes] == 0).all()


def test_few_cameras_know_nothing() -> None:
    pictures = pictures_of(0.0)
    pictures.mask[2:] = False
    found, confidence = swept_depth(pictures, VIEW)
    assert np.isnan(found).all()
    assert confidence.max() == 0
