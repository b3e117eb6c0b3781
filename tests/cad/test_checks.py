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
from tbcad.cad.kernel.checks import properties, without_slack
from tbcad.cad.kernel.solids import cylinder, edges, one_solid
from tests.step_read_back import check_read_back

SLACK_MM = 1e-3


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
