"""Rays and lines against closed forms; fits against points that lie exactly on surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from tbcad_verify.mesh.fits import fit_surfaces, patch_vertices
from tbcad_verify.mesh.mesh import indexed_mesh
from tbcad_verify.mesh.segments import Segmentation
from tbcad_verify.mesh.surfaces import Surfaces, nearest_to_origin, prepare_for_rays, reflect
from tbcad_verify.mesh.vectors import (
    cross,
    crossings,
    distances_to_segments,
    dot,
    nearest_on_lines,
    norm,
    rotation_angles,
    tangent_basis,
    unit,
)

RNG = np.random.default_rng(5)


def column(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float64)[:, None]


def sphere(centre: np.ndarray, radius: float, normal: np.ndarray) -> Surfaces:
    return Surfaces(centre + radius * normal, normal, np.array([1 / radius]))


def test_vectors_agree_with_numpy() -> None:
    a, b = RNG.normal(size=(2, 3, 50))
    np.testing.assert_allclose(cross(a, b), np.cross(a.T, b.T).T, atol=1e-15)
    np.testing.assert_allclose(dot(a, b), (a * b).sum(axis=0), atol=1e-14)
    frame = np.stack([*tangent_basis(unit(a)), unit(a)])
    np.testing.assert_allclose(
        np.einsum("ijn,kjn->nik", frame, frame), np.eye(3)[None].repeat(50, 0), atol=1e-14
    )


@pytest.mark.parametrize("angle", [0.05, 0.2, 0.5])
def test_reflection_off_a_sphere_on_the_axis(angle: float) -> None:
    """Pinhole at height h over a sphere's top: the ray at `angle` from the sphere's axis, seen
    from its centre, leaves at angle + (angle + view) from the axis."""
    radius, h = 20.0, 150.0
    top = sphere(column(0, 0, -radius), radius, column(0, 0, 1))
    hit = np.array([radius * np.sin(angle), 0, radius * np.cos(angle) - radius])
    pinhole = np.array([0, 0, h])
    lines = reflect(prepare_for_rays(pinhole, top), np.array([0]), (hit - pinhole)[:, None])
    np.testing.assert_allclose(lines.point[:, 0], hit, atol=1e-12)
    view = np.arctan2(hit[0], h - hit[2])
    out = view + 2 * angle
    np.testing.assert_allclose(unit(lines.toward)[:, 0], [np.sin(out), 0, np.cos(out)], atol=1e-13)
    expected = abs(hit[0] * np.cos(out) - hit[2] * np.sin(out))
    assert norm(nearest_to_origin(lines))[0] == pytest.approx(expected, abs=1e-12)
    assert lines.reach[0] == pytest.approx(1)


def test_reflection_off_a_plane_comes_from_the_mirror_image() -> None:
    normal = unit(column(1, 2, 3))
    plane = Surfaces(column(4, 5, 6), normal, np.zeros(1))
    pinhole = np.array([30.0, 40, 50])
    image = pinhole - 2 * ((pinhole - [4, 5, 6]) @ normal[:, 0]) * normal[:, 0]
    d = column(4, 5, 6) + 3 * tangent_basis(normal)[0] - pinhole[:, None]
    lines = reflect(prepare_for_rays(pinhole, plane), np.array([0]), d)
    back = unit(lines.point - image[:, None])
    np.testing.assert_allclose(unit(lines.toward), back, atol=1e-13)


def test_nearly_flat_joins_flat_without_a_jump() -> None:
    pinhole, d = np.array([50.0, 0, 100]), column(-0.5, 0.02, -1)
    points = []
    for curvature in (0.0, 1e-14, 1e-10, 1e-7):
        surface = Surfaces(column(0, 0, 0), column(0, 0, 1), np.array([curvature]))
        points.append(reflect(prepare_for_rays(pinhole, surface), np.array([0]), d).toward)
    for toward in points[1:]:
        np.testing.assert_allclose(toward, points[0], atol=1e-5)
    np.testing.assert_allclose(points[1], points[0], atol=1e-12)


def test_a_ray_that_misses_the_sphere_is_nan() -> None:
    top = sphere(column(0, 0, -1), 1.0, column(0, 0, 1))
    lines = reflect(prepare_for_rays(np.array([0, 0, 9.0]), top), np.array([0]), column(1, 0, -1))
    assert np.isnan(lines.point).all()


def test_coat_lies_above_and_keeps_the_centre() -> None:
    bare = sphere(column(1, 2, 3), 7.0, unit(column(1, 0, 1)))
    coated = bare.coated(0.25)
    np.testing.assert_allclose(coated.centre(), bare.centre(), atol=1e-12)
    assert 1 / coated.curvature[0] == pytest.approx(7.25)
    assert bare.height(coated.point)[0] == pytest.approx(0.25)


def cap(centre: np.ndarray, radius: float, half: float, count: int = 400) -> np.ndarray:
    """(N, 3) points on a sphere round its top, within a half width."""
    r = half * np.sqrt(RNG.random(count))
    a = 2 * np.pi * RNG.random(count)
    x, y = r * np.cos(a), r * np.sin(a)
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    turn[:, 2] *= np.sign(np.linalg.det(turn))
    return np.stack([x, y, np.sqrt(radius**2 - x**2 - y**2)], axis=1) @ turn.T + centre


def fitted(points: np.ndarray):
    """Fit one segment whose facets are triples of the points, turned outward."""
    middle = points.mean(axis=0)
    order = np.argsort(np.linalg.norm(points - middle, axis=1))[:300].reshape(-1, 3)
    mesh = indexed_mesh(points, np.sort(order, axis=1).astype(np.int32))
    outward = mesh.area.T @ np.linalg.svd(points - middle)[2][2]
    faces = np.where((outward < 0)[:, None], mesh.faces[:, ::-1], mesh.faces)
    mesh = indexed_mesh(points, faces)
    segments = Segmentation(np.zeros(len(faces), np.int32), 1)
    return fit_surfaces(mesh, segments, patch_vertices(mesh, segments)), mesh


@pytest.mark.parametrize(("radius", "half"), [(7.0, 2.0), (30.0, 3.5), (65.0, 3.5), (400.0, 8.0)])
def test_exact_points_give_the_exact_sphere(radius: float, half: float) -> None:
    centre = np.array([60.0, -40, 50])
    fits, _ = fitted(cap(centre, radius, half))
    assert abs(1 / fits.surfaces.curvature[0]) == pytest.approx(radius, rel=1e-8)
    np.testing.assert_allclose(fits.surfaces.centre()[:, 0], centre, rtol=0, atol=1e-6)
    assert fits.form[0] < 1e-10


@pytest.mark.parametrize(("radius", "half"), [(7.0, 2.0), (65.0, 3.5)])
def test_float32_points_give_it_within_a_micrometre(radius: float, half: float) -> None:
    centre = np.array([60.0, -40, 50])
    points = cap(centre, radius, half).astype(np.float32).astype(np.float64)
    fits, _ = fitted(points)
    np.testing.assert_allclose(fits.surfaces.centre()[:, 0], centre, rtol=0, atol=1e-3)
    assert 1e-7 < fits.form[0] < 4e-6


def test_a_plane_has_no_curvature() -> None:
    points = RNG.normal(size=(300, 3)) * [4, 3, 0]
    fits, _ = fitted(points)
    assert abs(fits.sag[0]) < 1e-9
    assert abs(fits.surfaces.normal[2, 0]) == pytest.approx(1)
    assert fits.form[0] < 1e-10


def test_four_corners_of_a_square_are_a_plane() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    mesh = indexed_mesh(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    segments = Segmentation(np.zeros(2, np.int32), 1)
    fits = fit_surfaces(mesh, segments, patch_vertices(mesh, segments))
    assert abs(fits.sag[0]) < 1e-6
    np.testing.assert_allclose(fits.surfaces.normal[:, 0], [0, 0, 1], atol=1e-9)


def test_form_error_is_what_was_added() -> None:
    points = cap(np.zeros(3), 30.0, 3.5, 4000)
    noisy = points * (1 + 2e-3 / 30 * RNG.normal(size=(4000, 1)))
    fits, _ = fitted(noisy)
    mesh_points = 300  # only vertices of facets count
    assert fits.form[0] == pytest.approx(2e-3, rel=4 / np.sqrt(2 * mesh_points))


def test_height_is_the_true_distance() -> None:
    ball = sphere(column(1, 2, 3), 5.0, column(0, 0, 1))
    x = RNG.normal(size=(3, 20)) * 2 + column(1, 2, 8)
    many = Surfaces(*(np.repeat(v, 20, axis=-1) for v in (ball.point, ball.normal, ball.curvature)))
    np.testing.assert_allclose(many.height(x), norm(x - column(1, 2, 3)) - 5, atol=1e-12)


def test_nearest_points_of_lines() -> None:
    point, direction = RNG.normal(size=(2, 3, 50))
    nearest = nearest_on_lines(point, direction)
    np.testing.assert_allclose(dot(nearest, direction), 0, atol=1e-12)
    np.testing.assert_allclose(norm(np.cross(nearest - point, direction, axis=0)), 0, atol=1e-12)


@pytest.mark.parametrize(("first", "last", "x"), [(-9, 9, 0), (6, 9, 1), (-9, 4, -1)])
def test_nearest_points_of_a_part_of_a_line(first: float, last: float, x: float) -> None:
    nearest = nearest_on_lines(column(-5, 2, 0), column(1, 0, 0), first, last)
    np.testing.assert_array_equal(nearest, column(x, 2, 0))


def test_crossings_lie_on_line_and_plane() -> None:
    point, direction, normal = RNG.normal(size=(3, 3, 50))
    crossing = crossings(point, direction, normal)
    np.testing.assert_allclose(dot(crossing, normal), 0, atol=1e-11)
    off = np.cross(crossing - point, direction, axis=0)
    np.testing.assert_allclose(norm(off), 0, atol=1e-11)


@pytest.mark.parametrize(
    ("x", "distance"), [((1, 3, 4), 5), ((-3, 0, 4), 5), ((5, 4, 0), 5), ((2, 0, 0), 0)]
)
def test_distances_from_a_segment(x: tuple[float, ...], distance: float) -> None:
    found = distances_to_segments(column(*x), column(0, 0, 0), column(2, 0, 0))
    assert found[0] == pytest.approx(distance)


@pytest.mark.parametrize(("centre", "turns"), [((0, 0), 1), ((0.9, 0), 1), ((3, 0), 0)])
def test_rotation_angles_add_up_to_the_winding_number(
    centre: tuple[float, float], turns: int
) -> None:
    angle = 2 * np.pi * np.arange(40) / 40
    circle = np.stack([np.cos(angle) - centre[0], np.sin(angle) - centre[1], angle])
    axis = np.repeat(column(0, 0, 1), 40, axis=1)
    for path, sign in ((circle, 1), (circle[:, ::-1], -1)):
        found = rotation_angles(axis, path, np.roll(path, -1, axis=1)).sum()
        assert found == pytest.approx(2 * np.pi * turns * sign, abs=1e-12)
