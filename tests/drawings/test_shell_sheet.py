"""Hatching: where material is cut, and nowhere else."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbcad.drafting.sheet import rectangle
from tbcad.drafting.views import straight
from tbcad.drawings.shell_sheet import HATCH_MM, hatching
from tbcad.formats.entities import Layer, Polyline


def closed(box: tuple[float, float, float, float]) -> Polyline:
    outline = rectangle(box, Layer.CUT)
    return Polyline(Layer.CUT, (*outline.corners, outline.corners[0]), closed=False)


@given(st.floats(20, 80), st.floats(20, 80), st.floats(2, 8))
def test_lines_cover_the_area_but_not_the_hole(width: float, height: float, half: float) -> None:
    x, y = width / 2, height / 2
    hole = closed((x - half, y - half, x + half, y + half))
    lines = straight(hatching([closed((0.0, 0.0, width, height)), hole]))
    covered = HATCH_MM * sum(math.dist(*ends) for ends in lines)
    assert covered == pytest.approx(width * height - 4 * half**2, rel=0.1)
    middles = np.array([np.mean(ends, axis=0) for ends in lines]) - (x, y)
    assert (np.abs(middles).max(axis=1) >= half - 1e-6).all()
    assert {round(math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))) for a, b in lines} == {45}
