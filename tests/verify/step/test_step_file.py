"""STEP files of known solids, read as text and by the kernel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Quaternion, gp_Trsf
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Controller, STEPControl_Writer
from OCP.TopoDS import TopoDS_Shape
from tbcad_verify.report.checks import Unknown
from tbcad_verify.run.processes import Processes
from tbcad_verify.step import step_file
from tbcad_verify.step.step_file import StepFile, examine_all, known, load, read_file

from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.solids import polygon, prism, solids


def written(folder: Path, *shapes: TopoDS_Shape) -> Path:
    """A build's file, or what the kernel writes by itself of several shapes."""
    path = folder / "part.step"
    if len(shapes) == 1 and len(found := solids(shapes[0])) == 1:
        write_step(path, Solid("part", found[0], ()))
        return path
    STEPControl_Controller.Init_s()
    writer = STEPControl_Writer()
    for shape in shapes:
        writer.Transfer(shape, STEPControl_AsIs)
    writer.Write(str(path))
    return path


def box(low: tuple[float, ...], high: tuple[float, ...]) -> TopoDS_Shape:
    return BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()


def ball(radius: float, z: float = 0) -> TopoDS_Shape:
    return BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, z), radius).Shape()


BOX = box((-5, -10, -15), (5, 10, 15))


def examine(folder: Path, name: str, seconds: float) -> StepFile:
    with Processes(1, seconds) as processes:
        return known(examine_all([load(folder, name)], processes)[0])


def test_box_in_closed_form(tmp_path: Path) -> None:
    found = read_file(written(tmp_path, box((-4, -8, -12), (6, 12, 18))))
    assert found.counts == {"solids": 1, "shells": 1, "open_edges": 0}
    assert found.valid
    assert found.mass.volume == pytest.approx(6000, rel=1e-12)
    assert found.mass.area == pytest.approx(2200, rel=1e-12)
    assert found.mass.centroid == pytest.approx([1, 2, 3], abs=1e-9)
    assert found.mass.low == pytest.approx([-4, -8, -12], abs=1e-9)
    assert found.mass.high == pytest.approx([6, 12, 18], abs=1e-9)
    assert found.properties == {
        "volume": pytest.approx(6000),
        "area": pytest.approx(2200),
        "centroid": pytest.approx([1, 2, 3]),
    }
    faces = found.faces
    assert set(faces.kind) == {"plane"}
    assert sorted(faces.area) == pytest.approx([200, 200, 300, 300, 600, 600])
    outward = ((faces.middle - [1, 2, 3]) * faces.normal).sum(axis=1)
    assert sorted(outward) == pytest.approx([5, 5, 10, 10, 15, 15])


def test_a_side_that_crosses_itself_is_not_valid(tmp_path: Path) -> None:
    """The builder leaves it to the verification to ask this of a shell."""
    crossed = np.array([[0.0, 0, 0], [10, 8, 0], [10, 0, 0], [0, 9, 0]])
    assert not read_file(written(tmp_path, prism(polygon(crossed), 5 * np.eye(3)[2]))).valid


def test_ball_and_its_hollow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The box is the patch's own, not the whole surface's; hollows are told from balls."""
    monkeypatch.setattr(step_file, "refuse_foreign", lambda _: None)  # no build has voids
    solid = read_file(written(tmp_path, ball(3, 5)))
    assert solid.counts == {"solids": 1, "shells": 1, "open_edges": 0}
    assert solid.faces.outward.all()
    assert solid.faces.area.sum() == pytest.approx(36 * np.pi, rel=1e-9)
    assert solid.faces.radius == pytest.approx([3])
    cut = BRepAlgoAPI_Cut(box((-10, -10, -10), (10, 10, 10)), ball(3)).Shape()
    hollow = read_file(written(tmp_path, cut))
    assert hollow.counts["shells"] == 2
    spheres = hollow.faces.kind == "sphere"
    assert spheres.any()
    assert not hollow.faces.outward[spheres].any()
    assert hollow.mass.volume == pytest.approx(8000 - 36 * np.pi, rel=1e-9)


def test_box_of_a_cap(tmp_path: Path) -> None:
    cap = BRepAlgoAPI_Common(ball(10), box((-20, -20, 8), (20, 20, 18))).Shape()
    found = read_file(written(tmp_path, cap))
    wide = 6.0  # the circle 8 mm up a sphere of 10
    assert found.mass.low == pytest.approx([-wide, -wide, 8], abs=1e-6)
    assert found.mass.high == pytest.approx([wide, wide, 10], abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_box_of_a_turned_ball_with_a_flat(tmp_path: Path, seed: int) -> None:
    """A ball's top is its box's, where it is not cut off; else the flat's rim is."""
    radius, flat = 7.3, 4.0
    turn = gp_Trsf()
    turn.SetRotation(gp_Quaternion(*np.random.default_rng(seed).normal(size=4).tolist()))
    upright = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))
    cut = BRepPrimAPI_MakeSphere(upright, radius, -np.pi / 2, np.arcsin(flat / radius)).Shape()
    found = read_file(written(tmp_path, BRepBuilderAPI_Transform(cut, turn, True).Shape()))
    up = gp_Dir(0, 0, 1).Transformed(turn)
    cosine = np.outer([-1, 1], [up.X(), up.Y(), up.Z()])
    rim = cosine * flat + np.sqrt(radius**2 - flat**2) * np.sqrt(1 - cosine**2)
    low, high = np.where(cosine * radius <= flat, radius, rim)
    assert found.mass.low == pytest.approx(-low, abs=1e-6)
    assert found.mass.high == pytest.approx(high, abs=1e-6)


def test_in_a_process_of_its_own(tmp_path: Path) -> None:
    file = written(tmp_path, BOX)
    found, here = examine(tmp_path, file.name, 60), read_file(file)
    assert found.mass == here.mass
    assert found.faces.names == here.faces.names


def test_what_takes_too_long_is_unknown(tmp_path: Path) -> None:
    file = written(tmp_path, BOX)
    with pytest.raises(Unknown, match="no answer within"):
        examine(tmp_path, file.name, 0.05)
