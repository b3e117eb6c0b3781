"""Balls on meshes of two spheres, against closed forms and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from tbcad_verify.mesh.mesh import Mesh, indexed_mesh
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.touching_balls import cut_depths
from tbcad_verify.mesh.vectors import unit
from tbcad_verify.shell.cutter import CutterReach, measure_reach
from trimesh.triangles import closest_point

# Of two spheres, and of their centres from x = 0, mm: slopes of 13 degrees.
RADIUS, ASIDE = 20.0, 4.5
HALF = 2.0  # width and length of what is meshed, mm


def two_spheres(hollow: bool, step: float = 0.05) -> tuple[Mesh, np.ndarray, Surfaces]:
    """A valley between bulging spheres, or its negative: two pockets with a ridge; light above."""
    count = 2 * round(HALF / step) + 1
    x, y = (one.ravel() for one in np.meshgrid(*2 * [np.linspace(-HALF, HALF, count)]))
    z = np.sqrt(RADIUS**2 - (np.abs(x) - ASIDE) ** 2 - y**2)
    at = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    faces = np.concatenate(
        [np.stack([at, at + 1, at + count + 1], 1), np.stack([at, at + count + 1, at + count], 1)]
    )
    mesh = indexed_mesh(np.stack([x, y, -z if hollow else z], 1), faces.astype(np.int32))
    side = -1.0 if hollow else 1.0
    apex = np.array([[-ASIDE, ASIDE], [0, 0], [side * RADIUS] * 2])
    up = np.array([[0, 0], [0, 0], [1.0, 1.0]])
    own = (x[faces].mean(axis=1) > 0).astype(np.intp)
    return mesh, own, Surfaces(apex, up, np.full(2, side / RADIUS))


def on_left(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (3, N) of the left bulging sphere at y = 0, and its normals."""
    points = np.stack([x, 0 * x, np.sqrt(RADIUS**2 - (x + ASIDE) ** 2)])
    return points, unit(points + np.array([[ASIDE], [0], [0]]))


@pytest.mark.parametrize("radius", [0.25, 0.5, 2.0])
def test_a_ball_in_a_valley_touches_both_sides(radius: float) -> None:
    """Its centre is on x = 0, both radii away from both centres: so it touches at `reached`."""
    mesh, own, surfaces = two_spheres(hollow=False)
    reached = ASIDE * radius / (RADIUS + radius)
    points, normals = on_left(-reached * np.array([0.0, 0.5, 0.95, 1.05, 1.5]))
    depth = cut_depths(mesh, points, normals, radius)
    assert (depth > 0).tolist() == [True, True, True, False, False]
    centres = points + radius * normals
    gap = np.linalg.norm(centres - [[ASIDE], [0], [0]], axis=0) - RADIUS
    assert depth[:3] == pytest.approx((radius - gap)[:3], abs=1e-4)
    x, y = np.meshgrid(np.linspace(0, HALF, 2001), np.linspace(0, HALF, 201))
    area = 1 / np.sqrt(RADIUS**2 - (x - ASIDE) ** 2 - y**2)  # of equal steps
    wanted = area[x > reached].sum() / area.sum()
    assert measure_reach(mesh, own, surfaces, radius).share == pytest.approx(wanted, abs=2e-3)


def pockets(radius: float, raised: float = 0.0) -> CutterReach:
    mesh, own, surfaces = two_spheres(hollow=True, step=0.2)
    points = mesh.points.copy()
    points[np.abs(points - [1.0, 1.0, 0])[:, :2].sum(axis=1).argmin(), 2] += raised
    return measure_reach(indexed_mesh(points, mesh.faces), own, surfaces, radius)


def test_smaller_balls_reach_pockets_and_their_ridge() -> None:
    for radius in (0.1, 2.0, RADIUS):
        reach = pockets(radius)
        assert (reach.share.tolist(), reach.depth.tolist()) == ([1, 1], [0, 0])


def test_larger_balls_reach_no_pocket() -> None:
    reach = pockets(1.2 * RADIUS)
    assert reach.share.tolist() == [0, 0]
    assert (reach.depth > 0.01).all()


def test_a_raised_corner_is_in_the_way_of_its_mirror() -> None:
    reach = pockets(2.0, raised=0.2)
    assert reach.share[0] == 1
    assert 0.5 < reach.share[1] < 1
    assert 0.05 < reach.depth[1] < 0.2


def test_large_triangles_are_met_where_brute_force_meets_them() -> None:
    """Points between large and small triangles that cross, in any direction."""
    random = np.random.default_rng(1)
    sizes = np.repeat([0.2, 20.0], [300, 12])[:, None, None]
    corners = random.normal(size=(312, 1, 3)) * 3 + sizes * random.normal(size=(312, 3, 3))
    mesh = indexed_mesh(corners.reshape(-1, 3), np.arange(936, dtype=np.int32).reshape(-1, 3))
    touched, normal = random.normal(size=(3, 400)) * 4, unit(random.normal(size=(3, 400)))
    for radius in (0.3, 3.0):
        centre = (touched + radius * normal).T
        near = [closest_point(corners, np.tile(one, (312, 1))) - one for one in centre]
        wanted = np.maximum(radius - np.linalg.norm(near, axis=2).min(axis=1), 0)
        found = cut_depths(mesh, touched, normal, radius)
        assert found == pytest.approx(wanted, abs=1e-4)
        assert (wanted > 0).sum() > 50
