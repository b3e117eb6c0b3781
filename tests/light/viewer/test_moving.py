"""Views that move: which virtual camera a pixel is taken from, and how good they are."""

import numpy as np
import pytest

from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.pictures import PinholePictures, pinhole_pictures
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tbcad.light.simulate.views.ray_bundle import TwoPlane, two_plane_along
from tbcad.light.viewer.moving import moving_view
from tbcad.types import Floats

CAPTURE_MM = 60.0
FAR = (1e3,)


def seen_from(distance: float) -> Camera:
    return camera_around_object(*np.radians([70, 35]), distance, CAPTURE_MM, (150, 100))


def numbered(count: int, seed: int) -> PinholePictures:
    """Virtual cameras at random, each with a picture of one colour, its number."""
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    axes *= np.linalg.det(axes)[:, None, None]
    centre = -rng.uniform(90, 400, count)[:, None] * axes[:, 2]
    picture = np.zeros((count, 4, 4, 3), dtype=np.uint8)
    picture[...] = np.arange(count)[:, None, None, None] + 1
    # So wide that the whole capture sphere is in every picture.
    return PinholePictures(
        centre, axes, np.ones(count), picture, np.ones(picture.shape[:3], dtype=bool), CAPTURE_MM
    )


@pytest.fixture(scope="module")
def pictures(light_field: LightField) -> PinholePictures:
    return pinhole_pictures(light_field)


def distance(two_plane: TwoPlane, target: Floats, centre: Floats) -> float:
    """Of a target ray (4,) from the nearest of all rays through a point, by least squares.

    A ray through (x, y) at depth z, in units of s, with slope (a, b) is (x - z a, y - z b, a, b).
    """
    x, y, z = two_plane.place(centre[None])[0]
    matrix = np.array([[-z, 0.0], [0.0, -z], [1.0, 0.0], [0.0, 1.0]])
    wanted = target - [x, y, 0, 0]
    slopes = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    return float(np.linalg.norm(matrix @ slopes - wanted))


@pytest.mark.parametrize("reach", [150.0, 640.0])
def test_a_pixel_is_of_the_nearest_virtual_camera(reach: float) -> None:
    pictures, view = numbered(120, 5), seen_from(reach)
    image = moving_view(pictures, view, FAR)
    two_plane = two_plane_along(view.forward, view.right, CAPTURE_MM)
    direction = view_directions(view)
    front = np.flatnonzero((pictures.centre @ view.forward) < 0)
    for row, column in np.random.default_rng(1).integers(0, (100, 150), (60, 2)):
        ray = direction[row, column]
        passes = np.linalg.norm(np.cross(view.pinhole, ray)) > CAPTURE_MM / 2
        target = two_plane.coordinates(view.pinhole[None], ray[None])[0]
        distances = [distance(two_plane, target, pictures.centre[k]) for k in front]
        expected = 0 if passes else front[np.argmin(distances)] + 1
        assert image[row, column].tolist() == [expected] * 3


def test_nothing_near_is_black_and_the_second_limit_fills_it() -> None:
    pictures, view = numbered(40, 2), seen_from(640.0)
    near, wide = (moving_view(pictures, view, limits) for limits in ((1.0,), (1.0, 1e3)))
    assert (near == 0).mean() > 0.5
    kept = near > 0
    assert (near[kept] == wide[kept]).all()
    assert (wide > 0).mean() > (near > 0).mean()


def test_masked_pictures_are_not_taken() -> None:
    pictures, view = numbered(40, 3), seen_from(640.0)
    used = np.unique(moving_view(pictures, view, FAR))
    pictures.mask[used[-1] - 1] = False
    assert used[-1] not in moving_view(pictures, view, FAR)


def test_places_in_pictures_are_the_cameras_own(pictures: PinholePictures) -> None:
    """Each picture seen from its own pinhole is that picture."""
    size, number = pictures.mask.shape[1], 17
    hfov = 2 * np.arctan(size / 2 / pictures.focal_px[number])
    right, _, forward = pictures.axes[number]
    view = Camera(pictures.centre[number], forward, right, size, size, float(hfov))
    image, known = moving_view(pictures, view, (1e-6,)), pictures.mask[number]
    assert known.sum() > 100
    difference = image[known].astype(int) - pictures.picture[number][known]
    assert np.abs(difference).max() <= 1
