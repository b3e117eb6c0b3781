"""Pictures of a ball's field: depth, opacity and normals against closed forms."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from tbcad.light.depth.depth_map import depth_png, depth_points
from tbcad.light.reconstruction.field import Field, Grid
from tbcad.light.reconstruction.picture import (
    FieldPicture,
    field_normals,
    field_picture,
    normals_png,
    opacity_png,
)
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tests.light.reconstruction.balls import COLOUR, NODES, RADIUS, WIDTH_MM, ball, nothing

VIEW = camera_around_object(0.7, 0.5, 200.0, WIDTH_MM, (64, 48))
PITCH = WIDTH_MM / (NODES - 1)


@pytest.fixture(scope="module")
def picture() -> FieldPicture:
    return field_picture(ball(steep=40.0), VIEW)


@pytest.fixture(scope="module")
def away() -> np.ndarray:
    """Distance of each pixel's ray from the middle, mm."""
    return np.asarray(np.linalg.norm(np.cross(view_directions(VIEW), VIEW.pinhole), axis=-1))


def test_rays_are_opaque_on_the_ball_and_not_beside_it(
    picture: FieldPicture, away: np.ndarray
) -> None:
    on, beside = away < RADIUS - PITCH, away > RADIUS + PITCH
    assert (picture.opacity[on] > 0.99).all()
    assert (picture.opacity[beside] == 0).all()
    assert np.isnan(picture.distance[beside]).all()
    assert picture.image[on] == pytest.approx(np.full((on.sum(), 3), 255 * np.array(COLOUR)), abs=2)
    grey = np.asarray(Image.open(BytesIO(opacity_png(picture))))
    assert grey.shape == (48, 64)
    assert (grey[on] >= 253).all()
    assert (grey[beside] == 0).all()


def test_the_depth_is_that_of_the_ball(picture: FieldPicture, away: np.ndarray) -> None:
    on = away < 0.9 * RADIUS
    points = depth_points(VIEW, picture.depth(VIEW))
    assert np.linalg.norm(points[on], axis=1) == pytest.approx(
        np.full(on.sum(), RADIUS), abs=PITCH / 2
    )
    number = np.asarray(Image.open(BytesIO(depth_png(picture.depth(VIEW), WIDTH_MM))))
    assert number.dtype == np.uint16
    assert (number[away > RADIUS + PITCH] == 0).all()
    middle = number[24, 32] / 65535
    assert middle == pytest.approx(0.5 + RADIUS / WIDTH_MM, abs=PITCH / 2 / WIDTH_MM)


def test_normals_are_radial_and_toward_the_view(away: np.ndarray) -> None:
    picture = field_picture(ball(), VIEW)
    normals = field_normals(ball(), VIEW, picture)
    on = away < 0.8 * RADIUS
    points = depth_points(VIEW, picture.depth(VIEW))[on]
    radial = points / np.linalg.norm(points, axis=1)[:, None]
    assert ((normals[on] * radial).sum(axis=1) > np.cos(np.radians(2))).all()
    assert np.isnan(normals[np.isnan(picture.distance)]).all()
    shown = np.asarray(Image.open(BytesIO(normals_png(normals)))) / 255
    assert 2 * shown[on] - 1 == pytest.approx(normals[on], abs=0.01)
    assert (shown[0, 0] == 0).all()


def test_nothing_is_black_without_depth_also_where_cameras_look_away_or_past_it() -> None:
    backward = replace(VIEW, forward=-VIEW.forward)
    aside = replace(VIEW, pinhole=VIEW.pinhole + 3 * WIDTH_MM * VIEW.right)
    for view, made in ((backward, ball()), (aside, ball()), (VIEW, nothing())):
        picture = field_picture(made, view)
        assert not picture.image.any()
        assert not picture.opacity.any()
        assert np.isnan(picture.distance).all()
        assert np.isnan(field_normals(made, view, picture)).all()


def test_a_ball_beside_the_middle_is_where_the_camera_projects_it() -> None:
    made = ball(steep=40.0)
    shift = np.array([3, -4, 5])  # nodes
    grid = made.grid
    lattice = np.full((grid.n,) * 3, made.values[:, 0].min(), np.float32)
    lattice[tuple(grid.place.T)] = made.values[:, 0]
    every = np.argwhere(np.ones_like(lattice, bool)).astype(np.uint16)
    values = np.tile(made.values[0], (len(every), 1))
    values[:, 0] = np.roll(lattice, shift, axis=(0, 1, 2)).ravel()
    picture = field_picture(Field(Grid(grid.n, grid.width_mm, every), values), VIEW)
    rows, columns = np.nonzero(picture.opacity > 0.5)
    expected = VIEW.project(shift * PITCH)
    assert [columns.mean(), rows.mean()] == pytest.approx(expected, abs=0.5)
