"""Meshes of primitives, against closed forms."""

import numpy as np
import pytest

from tbcad.cad.meshing import SIDES, primitive_mesh
from tbcad.geometry.primitives import (
    Cylinder,
    Primitive,
    Prism,
    Revolved,
    Slot,
    rectangle,
    revolved_along,
    volume,
)
from tbcad.geometry.vectors import unit

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
        volume(body), rel=1e-8
    )  # sections are rounded to 1e-8 mm


def test_volume_of_a_slot() -> None:
    """The corners of its rods are a little beyond its flat sides."""
    slot = Slot(START, 3 * unit(np.cross(TILTED, START)), 2.0, 7 * TILTED)
    assert primitive_mesh(slot).volume() == pytest.approx(volume(slot), rel=1e-5)


def test_a_rod_is_in_its_place() -> None:
    corners = primitive_mesh(PRIMITIVES["rod"]).to_mesh64().vert_properties[:, :3] - START
    along = corners @ TILTED
    assert np.sort(along) == pytest.approx(np.repeat([0.0, 7.0], SIDES))
    radii = np.linalg.norm(corners - along[:, None] * TILTED, axis=1)
    assert radii == pytest.approx(2.0, rel=2e-3)


def test_a_prism_has_its_corners() -> None:
    corners = primitive_mesh(PRIMITIVES["prism, oblique"]).to_mesh64().vert_properties[:, :3]
    expected = np.vstack([TRIANGLE + START, TRIANGLE + START + [1.0, 2.0, 5.0]])
    assert np.sort(corners, axis=0) == pytest.approx(np.sort(expected, axis=0))


def test_a_ring_is_about_its_axis() -> None:
    corners = primitive_mesh(PRIMITIVES["ring"]).to_mesh64().vert_properties[:, :3]
    assert sorted(set(np.round(corners[:, 2], 9).tolist())) == [1.0, 5.0]
    radii = np.linalg.norm(corners[:, :2], axis=1)
    assert ((np.abs(radii - 3) < 0.01) | (np.abs(radii - 4) < 0.01)).all()
