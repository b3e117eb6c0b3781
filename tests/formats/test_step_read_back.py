"""A solid is compared with what a reader of its STEP file gets."""

import numpy as np
import pytest
from OCP.ShapeFix import ShapeFix_ShapeTolerance
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.brep import InvalidSolidError
from tbcad.cad.measures import properties
from tbcad.cad.solids import cylinder, one_solid
from tbcad.formats import step_read_back
from tbcad.formats.step_read_back import check_read_back

UP = np.array([0.0, 0.0, 1.0])


def rod(length: float) -> TopoDS_Solid:
    return one_solid("rod", cylinder(np.zeros(3), UP, 5.0, length))


def read_instead(monkeypatch: pytest.MonkeyPatch, shape: TopoDS_Shape) -> None:
    monkeypatch.setattr(step_read_back, "_read_back", lambda *_: shape)


def test_a_whole_solid_passes() -> None:
    check_read_back("rod", rod(20.0), properties(rod(20.0)))


def test_gaps_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    loose = rod(20.0)
    ShapeFix_ShapeTolerance().SetTolerance(loose, 2e-5)
    read_instead(monkeypatch, loose)
    with pytest.raises(InvalidSolidError, match=r"rod: its edges are up to 2e-05 mm off"):
        check_read_back("rod", rod(20.0), properties(rod(20.0)))


def test_another_volume_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    read_instead(monkeypatch, rod(20.001))
    with pytest.raises(InvalidSolidError, match="not give the same valid solid"):
        check_read_back("rod", rod(20.0), properties(rod(20.0)))
