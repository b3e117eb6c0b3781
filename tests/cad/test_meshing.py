"""Meshes of solids, and volumes by booleans of meshes."""

import numpy as np
import pytest
from OCP.TopoDS import TopoDS_Shape

from tbcad.cad.kernel.checks import volume
from tbcad.cad.kernel.meshing import (
    SIDES,
    as_manifold,
    meshed,
    primitive_mesh,
    volume_by_cut_mesh,
    volume_by_meshes,
)
from tbcad.cad.kernel.solids import cut, cylinder, fused, sphere
from tbcad.core.geometry.primitives import (
    Cylinder,
    Primitive,
    Prism,
    Revolved,
    rectangle,
    revolved_along,
)
from tbcad.core.geometry.primitives import (
    volume as closed_volume,
)
from tbcad.core.geometry.vectors import norm, unit

START, TILTED = np.array([1.0, -2.0, 3.0]), unit(np.array([0.3, -0.5, 0.8]))
TRIANGLE = np.array([[0.0, 0, 0], [4, 0, 0], [0, 3, 0]])
PRIMITIVES = {
    "rod": Cylinder(START, TILTED, 2.0, 7.0),
    "ring": Revolved(rectangle((1.0, 3.0), (5.0, 4.0))),
    "cone, tilted": revolved_along(np.array([[0.0, 0], [6, 0], [0, 2]]), START, TILTED),
    "prism": Prism(TRIANGLE, np.array([0.0, 0, 5])),
    "prism, downward": Prism(TRIANGLE, np.array([0.0, 0, -5])),
    "prism, oblique": Prism(TRIANGLE + START, np.array([1.0, 2.0, 5.0])),
}


@pytest.mark.parametrize("body", PRIMITIVES.values(), ids=PRIMITIVES)
def test_volumes_are_those_of_closed_forms(body: Primitive) -> None:
    assert primitive_mesh(body).volume() == pytest.approx(
        closed_volume(body), rel=1e-8
    )  # sections are rounded to 1e-8 mm


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


def test_a_rod_is_in_its_place() -> None:
    corners = primitive_mesh(PRIMITIVES["rod"]).to_mesh64().vert_properties[:, :3] - START
    along = corners @ TILTED
    assert np.sort(along) == pytest.approx(np.repeat([0.0, 7.0], SIDES))
    radii = np.linalg.norm(corners - along[:, None] * TILTED, axis=1)
    assert radii == pytest.approx(2.0, rel=2e-3)
