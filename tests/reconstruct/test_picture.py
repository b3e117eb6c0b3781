"""Pictures of a field of a ball in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.optics.camera import Camera
from tbcad.reconstruct.field import Field
from tbcad.reconstruct.grid import Grid
from tbcad.reconstruct.picture import FieldPicture, field_picture
from tbcad.simulate.scene.viewpoint import camera_around_object, view_directions
from tests.ray_fields import RADIUS

SIZE, DISTANCE, CENTRE, BALL = (96, 72), 60.0, np.array([1.0, 2.0, -1.5]), 4.0


@pytest.fixture(scope="module")
def ball() -> Field:
    grid = Grid(61, 2 * RADIUS, np.argwhere(np.ones((61,) * 3, bool)).astype(np.uint16))
    values = np.tile(np.float32([0, 0.8, 0.4, 0.2]), (len(grid), 1))
    depth = BALL - np.linalg.norm(grid.points - CENTRE, axis=1)
    values[:, 0] = np.clip(60 * depth, -3, 60)
    return Field(grid, values)


def camera() -> Camera:
    return camera_around_object(0.7, 0.4, DISTANCE, 2 * RADIUS, SIZE)


def expected(view: Camera) -> tuple[np.ndarray, np.ndarray]:
    """How far the lines of pixels pass the centre of the ball, and where they enter it, mm."""
    ways = view_directions(view)
    middle = ways @ (CENTRE - view.pinhole)
    passed = np.linalg.norm(CENTRE - view.pinhole - middle[..., None] * ways, axis=-1)
    return passed, middle - np.sqrt(np.maximum(BALL**2 - passed**2, 0))


def test_a_ball_has_its_outline_colour_and_distance(ball: Field) -> None:
    view = camera()
    picture: FieldPicture = field_picture(ball, view)
    passed, distance = expected(view)
    within, beside = passed < BALL - 0.2, passed > BALL + 0.1
    assert picture.image.shape == (*SIZE[::-1], 3)
    assert np.abs(picture.image[within].astype(int) - [204, 102, 51]).max() <= 1
    assert picture.opacity[within].min() > 0.99
    assert picture.image[beside].max() <= 2
    assert picture.opacity[beside].max() < 0.02
    assert np.isnan(picture.distance[beside]).all()
    inner = passed < BALL - 1
    assert picture.distance[inner] == pytest.approx(distance[inner], abs=0.25)


def test_a_camera_that_looks_away_sees_nothing(ball: Field) -> None:
    view = camera()
    picture = field_picture(ball, replace(view, forward=-view.forward))
    assert not picture.image.any()
    assert not picture.opacity.any()
    assert np.isnan(picture.distance).all()


def test_a_camera_that_misses_the_capture_sphere_sees_nothing(ball: Field) -> None:
    view = camera()
    aside = replace(view, pinhole=view.pinhole + 100 * view.right)
    assert not field_picture(ball, aside).image.any()


def test_an_empty_field_is_black() -> None:
    nothing = Field(Grid.about(np.zeros((4,) * 3, bool), 2 * RADIUS), np.zeros((0, 4), np.float32))
    picture = field_picture(nothing, camera())
    assert not picture.image.any()
    assert not picture.opacity.any()
