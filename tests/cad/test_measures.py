"""Volumes, areas and centroids by the kernel, against closed forms."""

import numpy as np
import pytest

from tbcad.cad.kernel.checks import (
    SolidProperties,
    face_integrals,
    mean_corner,
    plane_faces,
    properties,
    volume,
)
from tbcad.cad.kernel.solids import cylinder, faces, moved, polygon, prism, sphere
from tbcad.core.geometry.primitives import rectangle

START, UP = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0])


def test_a_cylinder() -> None:
    found = properties(cylinder(START, UP, 2.0, 5.0))
    assert found.volume == pytest.approx(20 * np.pi, rel=1e-12)
    assert found.area == pytest.approx(28 * np.pi, rel=1e-12)
    assert found.centroid == pytest.approx((1.0, 2.0, 5.5), abs=1e-12)


def test_a_sphere() -> None:
    ball = sphere(START, 7.0)
    assert volume(ball) == pytest.approx(4 / 3 * np.pi * 7**3, rel=1e-9)
    assert properties(ball).area == pytest.approx(4 * np.pi * 49, rel=1e-9)


def test_a_mirror_image_has_its_centroid_on_the_other_side() -> None:
    found = SolidProperties(1.0, 2.0, (3.0, 4.0, 5.0)).mirrored()
    assert found == SolidProperties(1.0, 2.0, (-3.0, 4.0, 5.0))


def test_a_rotated_solid_has_its_centroid_where_the_kernel_finds_it() -> None:
    solid, axes = cylinder(START, UP, 2.0, 5.0), np.roll(np.eye(3), 1, axis=1)
    found, expected = properties(solid).rotated(axes), properties(moved(solid, axes, np.zeros(3)))
    assert found.centroid == pytest.approx((5.5, 1.0, 2.0), abs=1e-12)
    assert found.centroid == pytest.approx(expected.centroid, abs=1e-12)
    assert (found.volume, found.area) == pytest.approx((expected.volume, expected.area))


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (10.0, -4.0, 2.0)])
def test_faces_add_up_to_their_solid(origin: tuple[float, float, float]) -> None:
    solid = cylinder(START, UP, 2.0, 5.0)
    first, *others = (face_integrals(face, np.array(origin)) for face in faces(solid))
    total = first
    for one in others:
        total = total + one
    found, expected = total.properties, properties(solid)
    assert found.volume == pytest.approx(expected.volume, rel=1e-9)
    assert found.area == pytest.approx(expected.area, rel=1e-9)
    assert found.centroid == pytest.approx(expected.centroid, abs=1e-8)


def test_plane_faces_and_corners_of_a_box() -> None:
    base = np.column_stack([rectangle([0.0, 0.0], [4.0, 2.0]), np.zeros(4)])
    box = prism(polygon(base), 3.0 * UP)
    centre, area = plane_faces(box)
    assert sorted(area.tolist()) == pytest.approx([6, 6, 8, 8, 12, 12])
    assert centre.mean(axis=0) == pytest.approx(mean_corner(box), abs=1e-12)


def test_plane_faces_through_points() -> None:
    base = np.column_stack([rectangle([0.0, 0.0], [4.0, 2.0]), np.zeros(4)])
    box = prism(polygon(base), 3.0 * UP)
    points = np.array([[9.0, 9.0, 3.01], [4.2, 1.0, 1.0]])
    centre, area = plane_faces(box, points, 0.1)
    assert centre == pytest.approx(np.array([[2.0, 1.0, 3.0]]))
    assert area == pytest.approx([8.0])
    assert len(plane_faces(box, points, 0.3)[1]) == 2
    assert not len(plane_faces(box, points[:0], 0.3)[1])


def test_curved_faces_are_left_out() -> None:
    centre, area = plane_faces(sphere(START, 1.0))
    assert centre.shape == (0, 3)
    assert area.shape == (0,)
