"""A solid that the kernel takes for valid may have gaps, which its tolerances hide."""

import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Geom import Geom_Circle
from OCP.GeomAbs import GeomAbs_Circle
from OCP.ShapeFix import ShapeFix_ShapeTolerance
from OCP.TopoDS import TopoDS_Solid

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.cad.kernel.checks import (
    face_integrals,
    plane_faces,
    properties,
    volume,
    without_slack,
)
from tbcad.cad.kernel.solids import cylinder, edges, faces, moved, one_solid, polygon, prism, sphere
from tbcad.core.geometry.primitives import rectangle
from tests.step_read_back import check_read_back

SLACK_MM = 1e-3
START, UP = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0])


def rod_with_gap(gap: float) -> TopoDS_Solid:
    """A rod whose round edges are off its faces, mm, and whose tolerances are SLACK_MM."""
    rod = one_solid("rod", cylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 5.0, 20.0))
    for edge in edges(rod):
        curve = BRepAdaptor_Curve(edge)
        if curve.GetType() == GeomAbs_Circle:
            circle = curve.Circle()
            circle.SetRadius(circle.Radius() + gap)
            BRep_Builder().UpdateEdge(edge, Geom_Circle(circle), SLACK_MM)
    ShapeFix_ShapeTolerance().SetTolerance(rod, SLACK_MM)
    assert BRepCheck_Analyzer(rod).IsValid()
    return rod


@pytest.mark.parametrize("gap", [0.0, 5e-6])
def test_what_meets_stays_valid(gap: float) -> None:
    rod = one_solid("rod", without_slack(rod_with_gap(gap)))
    check_read_back("rod", rod, properties(rod))


@pytest.mark.parametrize("gap", [2e-5, 5e-4])
def test_gaps_are_found_as_a_reader_of_the_file_finds_them(gap: float) -> None:
    rod = rod_with_gap(gap)
    with pytest.raises(InvalidSolidError, match=r"rod: its edges are up to .* mm off its faces"):
        check_read_back("rod", rod, properties(rod))
    with pytest.raises(InvalidSolidError, match="rod: the kernel's check finds the solid invalid"):
        one_solid("rod", without_slack(rod))


def test_a_cylinder() -> None:
    found = properties(cylinder(START, UP, 2.0, 5.0))
    assert found.volume == pytest.approx(20 * np.pi, rel=1e-12)
    assert found.area == pytest.approx(28 * np.pi, rel=1e-12)
    assert found.centroid == pytest.approx((1.0, 2.0, 5.5), abs=1e-12)


def test_a_sphere() -> None:
    ball = sphere(START, 7.0)
    assert volume(ball) == pytest.approx(4 / 3 * np.pi * 7**3, rel=1e-9)
    assert properties(ball).area == pytest.approx(4 * np.pi * 49, rel=1e-9)


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


def test_plane_faces_through_points() -> None:
    base = np.column_stack([rectangle([0.0, 0.0], [4.0, 2.0]), np.zeros(4)])
    box = prism(polygon(base), 3.0 * UP)
    points = np.array([[9.0, 9.0, 3.01], [4.2, 1.0, 1.0]])
    centre, area = plane_faces(box, points, 0.1)
    assert centre == pytest.approx(np.array([[2.0, 1.0, 3.0]]))
    assert area == pytest.approx([8.0])
    assert len(plane_faces(box, points, 0.3)[1]) == 2
    assert not len(plane_faces(box, points[:0], 0.3)[1])
