"""Boxes and volumes from faces and edges, held against the kernel's own slow ways."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.GeomAbs import GeomAbs_Sphere
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Quaternion, gp_Trsf, gp_Vec
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_WIRE
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape
from tbcad_verify.step.kernel.measures import _integrated, measure_face, moments_of
from tbcad_verify.step.kernel.shapes import (
    OUTWARD,
    between_arcs,
    box,
    corners_of,
    each,
    faces_of,
    reach_of_face,
    triple,
)

PLACE = gp_Ax2(gp_Pnt(30, -20, 10), gp_Dir(0, 0, 1))


def ball_at(centre: gp_Pnt) -> TopoDS_Shape:
    """A ball of 10 mm whose poles and seam are not in the eighth where x, y and z are positive."""
    return BRepPrimAPI_MakeSphere(
        gp_Ax2(centre, gp_Dir(1, -1, 0), gp_Dir(-1, -1, -1)), 10.0
    ).Shape()


def is_sphere(face: TopoDS_Face) -> bool:
    return bool(BRepAdaptor_Surface(face).GetType() == GeomAbs_Sphere)


def ball_and_cone() -> TopoDS_Shape:
    ball = BRepPrimAPI_MakeSphere(PLACE, 7.0).Shape()
    return BRepAlgoAPI_Fuse(ball, BRepPrimAPI_MakeCone(PLACE, 6.5, 1.0, 20.0).Shape()).Shape()


def drilled_plate() -> TopoDS_Shape:
    """A cylinder across a cylinder: their edge has no closed form."""
    post = BRepPrimAPI_MakeCylinder(PLACE, 5.0, 30.0).Shape()
    across = gp_Ax2(gp_Pnt(10, -19, 25), gp_Dir(1, 0, 0))
    return BRepAlgoAPI_Cut(post, BRepPrimAPI_MakeCylinder(across, 2.0, 40.0).Shape()).Shape()


def slanted_post() -> TopoDS_Shape:
    """A cylinder cut by a slanted plane, whose edge is an ellipse and an extreme."""
    turn, move = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Quaternion(0.3, 0.2, 0.1, 0.9))
    move.SetTranslation(gp_Vec(30, -20, 25))
    block = BRepPrimAPI_MakeBox(gp_Pnt(-50, -50, 0), gp_Pnt(50, 50, 60)).Shape()
    tilted = BRepBuilderAPI_Transform(block, move * turn, True).Shape()
    return BRepAlgoAPI_Cut(BRepPrimAPI_MakeCylinder(PLACE, 5.0, 40.0).Shape(), tilted).Shape()


def ring() -> TopoDS_Shape:
    return BRepPrimAPI_MakeTorus(PLACE, 12.0, 3.0).Shape()


@pytest.fixture(params=[ball_and_cone, drilled_plate, slanted_post, ring], ids=lambda f: f.__name__)
def shape(request: pytest.FixtureRequest) -> TopoDS_Shape:
    """A solid, turned out of the axes."""
    turn = gp_Trsf()
    turn.SetRotation(gp_Quaternion(0.1, -0.4, 0.3, 0.8))
    return BRepBuilderAPI_Transform(request.param(), turn, True).Shape()


def test_the_box_is_that_of_far_walls(shape: TopoDS_Shape) -> None:
    """No wall reaches deeper than the box, and most touch it: walls miss some tops of balls."""
    reach = np.array([reach_of_face(shape, axis) for axis in OUTWARD])
    low, high = box(shape, corners_of(shape))
    more = np.concatenate([np.negative(low), high]) - reach
    assert more.min() > -1e-6
    assert np.median(more) < 1e-6
    assert more.max() < 7.0


@pytest.mark.parametrize("kept", ["cap", "rest"])
def test_a_ball_between_arcs_in_closed_form(kept: str) -> None:
    """Three planes through the centre cut out an eighth of a ball, or all but an eighth."""
    turn = gp_Trsf()
    turn.SetRotation(gp_Quaternion(0.1, -0.4, 0.3, 0.8))
    place = gp_Pnt(3, -2, 1)
    cut = BRepAlgoAPI_Common if kept == "cap" else BRepAlgoAPI_Cut
    corner = BRepPrimAPI_MakeBox(place, gp_Pnt(53, 48, 51)).Shape()
    solid = cut(ball_at(place), corner).Shape()
    turned = BRepBuilderAPI_Transform(solid, turn, True).Shape()
    faces = [face for face in faces_of(turned) if is_sphere(face)]
    share = 0.125 if kept == "cap" else 0.875
    measured = [measure_face(face, np.zeros(3))[0] for face in faces]
    assert sum(row["area"] for row in measured) == pytest.approx(400 * np.pi * share, rel=1e-9)
    if kept == "cap":
        centre = np.array(triple(place.Transformed(turn)))
        (face,) = faces
        found = between_arcs(face, centre, 10.0)
        assert found is not None
        area, first, second = found
        slow = moments_of(face)
        assert area == pytest.approx(50 * np.pi, rel=1e-13)
        assert np.linalg.norm(first) == pytest.approx(250 * np.pi * np.sqrt(3), rel=1e-12)
        assert centre + first / area == pytest.approx(slow.middle, abs=1e-6)
        offset = slow.middle - centre
        whole = slow.second + slow.area * np.outer(offset, offset)
        assert second == pytest.approx(whole, abs=1e-6 * area * 100)


@pytest.fixture
def face() -> TopoDS_Face:
    """The round one of an eighth of a ball about the origin."""
    corner = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(50, 50, 50)).Shape()
    eighth = BRepAlgoAPI_Common(ball_at(gp_Pnt(0, 0, 0)), corner).Shape()
    return next(face for face in faces_of(eighth) if is_sphere(face))


def test_widened_edges_say_nothing_about_their_faces(face: TopoDS_Face) -> None:
    exact, kernels = 50 * np.pi, moments_of(face).area
    assert measure_face(face, np.zeros(3), 1e-7)[0]["area"] == pytest.approx(exact, rel=1e-14)
    assert measure_face(face, np.zeros(3), 1e-3)[0]["area"] == kernels


def test_an_outline_the_other_way_round_holds_the_rest_of_the_ball(face: TopoDS_Face) -> None:
    turned = TopoDS.Face_s(face.EmptyCopied())
    for wire in each(face.Oriented(TopAbs_FORWARD), TopAbs_WIRE):
        BRep_Builder().Add(turned, wire.Reversed())
    found, rest = between_arcs(face, np.zeros(3), 10.0), between_arcs(turned, np.zeros(3), 10.0)
    assert found is not None
    assert rest is not None
    assert rest[0] == pytest.approx(350 * np.pi, rel=1e-12)
    assert rest[1] == pytest.approx(-found[1], abs=1e-9)
    assert rest[2] + found[2] == pytest.approx(4 / 3 * np.pi * 1e4 * np.eye(3), abs=1e-7)


def test_under_round_faces_as_the_kernel_integrates(shape: TopoDS_Shape) -> None:
    origin = np.array([3.0, -40.0, 7.0])
    for face in faces_of(shape):
        _, found = measure_face(face, origin)
        expected = _integrated(face, origin)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
