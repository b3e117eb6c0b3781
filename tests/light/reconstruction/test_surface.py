"""The surface of a field against closed forms."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.core.optics.geodesic import geodesic
from tbcad.errors import InputError
from tbcad.light.depth.depth_map import depth_png, depth_points
from tbcad.light.reconstruction.field import Field, Grid
from tbcad.light.reconstruction.marching import GLOSSY
from tbcad.light.reconstruction.picture import (
    FieldPicture,
    field_normals,
    field_picture,
    normals_png,
    opacity_png,
)
from tbcad.light.reconstruction.surface import FACING, best_level, field_mesh, resolved_mm
from tbcad.light.simulate.scene.rays import camera_around_object, view_directions
from tests.light.reconstruction.balls import (
    BELOW,
    COLOUR,
    NODES,
    RADIUS,
    STEEP,
    WIDTH_MM,
    ball,
    made_of,
    nothing,
    parallel_rays,
)

PITCH = WIDTH_MM / (NODES - 1)
VIEW = camera_around_object(0.7, 0.5, 200.0, WIDTH_MM, (64, 48))


def closed(mesh: trimesh.Trimesh) -> bool:
    return bool(mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0)


@pytest.mark.parametrize("level", [1.0, 2.0])
def test_a_ball_has_the_surface_of_a_ball_and_a_denser_level_lies_deeper(level: float) -> None:
    mesh = field_mesh(ball(), level)
    deeper = (level - 0.01 / (4 * level) - BELOW) / STEEP
    away = np.linalg.norm(mesh.vertices, axis=1) - (RADIUS - deeper)
    assert np.abs(away).max() < PITCH / 10
    assert closed(mesh)
    assert mesh.body_count == 1


def test_random_numbers_have_closed_surfaces() -> None:
    random = np.random.default_rng(3)
    mesh = field_mesh(made_of(lambda at: random.normal(1.0, 2.0, len(at))), 1.0, 0.0)
    assert closed(mesh)


def test_a_surface_through_nodes_has_facets_of_some_area_as_written() -> None:
    mesh = field_mesh(made_of(lambda at: BELOW + 4.0 - np.abs(at).max(axis=1)), 1.0)
    corners = mesh.vertices[mesh.faces].astype(np.float32)
    for k in range(3):
        assert (corners[:, k] != corners[:, k - 1]).any(axis=1).all()
    assert closed(mesh)


def test_a_shell_is_full_inside() -> None:
    thick = made_of(lambda at: BELOW + STEEP * (0.5 - abs(np.linalg.norm(at, axis=1) - 6.5)))
    mesh = field_mesh(thick, 1.0)
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.01)


def test_below_a_dome_it_is_full_as_far_as_nothing_is_seen() -> None:
    def dome(at: np.ndarray) -> np.ndarray:
        shell = BELOW + STEEP * (0.5 - abs(np.linalg.norm(at, axis=1) - 6.5))
        return np.where(at[:, 2] > 0, shell, -3.0)

    mesh = field_mesh(made_of(dome), 1.0)
    assert closed(mesh)
    half = 2 / 3 * np.pi * 7**3
    assert 0.95 * half < mesh.volume < 1.4 * half


def test_a_speck_is_left_out_and_a_larger_body_is_not() -> None:
    def two(at: np.ndarray) -> np.ndarray:
        middles = ((0.0, 0, 0), (0, 0, 8))
        first, second = (np.linalg.norm(at - middle, axis=1) for middle in middles)
        return BELOW + STEEP * np.maximum(5 - first, 0.6 - second)

    assert field_mesh(made_of(two), 1.0, 2.5).body_count == 1
    assert field_mesh(made_of(two), 1.0, 0.5).body_count == 2
    with pytest.raises(InputError, match="larger than 30 mm"):
        field_mesh(made_of(two), 1.0, 30.0)


def test_nothing_lies_outside_of_the_capture_sphere() -> None:
    mesh = field_mesh(made_of(lambda at: np.full(len(at), 5.0)), 1.0)
    away = np.linalg.norm(mesh.vertices, axis=1)
    assert WIDTH_MM / 2 - PITCH < away.min() < away.max() < WIDTH_MM / 2


def test_points_have_the_colours_that_are_seen_there() -> None:
    made = ball()
    values = made.values.copy()
    right = made.grid.points[:, 0] > 0
    values[right, 1:4], values[~right, 1:4] = (1, 0, 0), (0, 1, 0)
    mesh = field_mesh(Field(made.grid, values), 1.0)
    colours = np.asarray(mesh.visual.vertex_colors)[:, :3]
    x = mesh.vertices[:, 0]
    assert (colours[x > 2] == (255, 0, 0)).all()
    assert (colours[x < -2] == (0, 255, 0)).all()


def test_a_glossy_field_has_the_mean_of_the_directions_that_see_it() -> None:
    made = made_of(lambda at: BELOW + STEEP * (RADIUS - np.linalg.norm(at, axis=1)), GLOSSY)
    made.values[:, 1] = 0.5
    made.values[:, 6] = 0.3  # of red, by z
    mesh = field_mesh(made, 1.0)
    top = np.argmax(mesh.vertices[:, 2])
    z = geodesic(3)[0][:, 2]
    expected = 0.5 - 0.3 * z[z > FACING].mean()
    assert mesh.visual.vertex_colors[top, 0] / 255 == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("silhouette", [7.5, 7.0, 6.3])
def test_the_level_is_that_of_the_silhouettes(silhouette: float) -> None:
    made = ball(8.0, 1.0)
    rays = parallel_rays(lambda away: away < silhouette)
    level = best_level(made, rays, rays.mirror % 4 == 0)
    number = BELOW + (8.0 - silhouette)
    density = (number + (number**2 + 0.01) ** 0.5) / 2
    assert level == pytest.approx(density, rel=0.15)


def test_black_things_do_not_change_the_level() -> None:
    rays = parallel_rays(lambda away: (away < 7.0) & (np.abs(away - 3) > 1))
    level = best_level(ball(8.0, 1.0), rays, rays.mirror >= 0)
    assert level == pytest.approx(2.0, rel=0.15)


def test_a_mirrors_pixel_is_its_share_of_the_capture_sphere() -> None:
    rays = parallel_rays(lambda away: away < 5, across=41)
    assert resolved_mm(rays) == pytest.approx(WIDTH_MM / 40, rel=0.03)


def test_fields_of_nothing_are_refused() -> None:
    rays = parallel_rays(lambda away: away < 0)
    with pytest.raises(InputError, match="no surface at level 1 1/mm: nothing in it is denser"):
        field_mesh(nothing(), 1.0)
    with pytest.raises(InputError, match="no surface"):
        best_level(nothing(), rays, rays.mirror >= 0)


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
