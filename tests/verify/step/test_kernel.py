"""Boxes and volumes from faces and edges, held against the kernel's own slow ways."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepGProp import BRepGProp
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Quaternion, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Controller, STEPControl_Writer
from OCP.TopoDS import TopoDS_Shape
from tbcad_verify.step.kernel.box import OUTWARD, box, reach_of_face
from tbcad_verify.step.kernel.reading import read_solid

PLACE = gp_Ax2(gp_Pnt(30, -20, 10), gp_Dir(0, 0, 1))


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
    low, high = box(shape)
    more = np.concatenate([np.negative(low), high]) - reach
    assert more.min() > -1e-6
    assert np.median(more) < 1e-6
    assert more.max() < 7.0


def test_the_volume_is_the_kernels(shape: TopoDS_Shape, tmp_path: Path) -> None:
    STEPControl_Controller.Init_s()
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_AsIs)
    writer.Write(str(tmp_path / "part.step"))
    found, expected = read_solid(tmp_path / "part.step"), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, expected)
    centre = expected.CentreOfMass()
    assert found["volume"] == pytest.approx(expected.Mass(), rel=1e-5)
    assert found["centroid"] == pytest.approx([centre.X(), centre.Y(), centre.Z()], abs=1e-4)
