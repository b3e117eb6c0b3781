"""Meshes of solids, and volumes by booleans of meshes."""

import numpy as np
import pytest
from OCP.TopoDS import TopoDS_Shape

from tbcad.cad.measures import volume
from tbcad.cad.meshing import (
    as_manifold,
    meshed,
    volume_by_cut_mesh,
    volume_by_meshes,
    without_degenerate,
)
from tbcad.cad.solids import cut, cylinder, fused, sphere
from tbcad.geometry.vectors import norm

ORIGIN, UP = np.zeros(3), np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def pin() -> TopoDS_Shape:
    return cylinder(ORIGIN, UP, 3.0, 10.0)


@pytest.mark.parametrize("tolerance", [0.1, 0.01])
def test_facets_are_as_near_to_a_sphere_as_asked(tolerance: float) -> None:
    mesh = meshed(sphere(ORIGIN, 5.0), tolerance)
    assert norm(mesh.vertices) == pytest.approx(5.0, abs=1e-6)
    middle = mesh.vertices[mesh.triangles].mean(axis=1)
    assert 5.0 - norm(middle).min() <= tolerance


def test_each_edge_has_two_facets(pin: TopoDS_Shape) -> None:
    triangles = meshed(pin, 0.1).triangles
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    directed, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 1).all()
    assert np.array_equal(directed, np.unique(edges[:, ::-1], axis=0))


def test_facets_without_area_are_dropped() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = without_degenerate(vertices, np.array([[0, 1, 2], [0, 1, 1], [2, 2, 0]]))
    assert mesh.triangles.tolist() == [[0, 1, 2]]


def test_volume_of_a_union_less_tools_agrees_with_the_kernel(pin: TopoDS_Shape) -> None:
    bodies, tools = [pin, sphere(10 * UP, 5.0)], [cylinder(-UP, UP, 1.0, 20.0)]
    by_meshes = volume_by_meshes(
        *([as_manifold(one, 0.002) for one in some] for some in (bodies, tools))
    )
    assert by_meshes == pytest.approx(volume(cut(fused(bodies), tools)), rel=2e-3)


def test_volume_below_a_plane(pin: TopoDS_Shape) -> None:
    planes = np.array([[0.0, 0.0, 1.0, 4.0]])
    below = volume_by_cut_mesh(pin, planes, [], 0.001)
    assert below == pytest.approx(36 * np.pi, rel=1e-3)
