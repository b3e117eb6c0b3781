"""Hatching: where material is cut, and nowhere else."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbcad.cad.drafting.sheet import rectangle
from tbcad.cad.drafting.views import straight
from tbcad.cad.formats.entities import Layer, Polyline, Text
from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.drawings.export import read_export
from tbcad.drawings.shell_views import HATCH_MM, hatching
from tbcad.drawings.write import draw_shell, drawable
from tbcad.output.build import write_export
from tbcad.output.parts import SHELL


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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edges", "said"), [("valley", "The shell is drawn along"), ("pedestal", "Undercut")]
)
def test_a_mandrels_sheet_says_how_the_shell_comes_off(
    tmp_path: Path, edges: str, said: str
) -> None:
    """Its notes have room above the frame, and it shows the section of the solid."""
    settings = ["n=3", "shell.negative=true", f"shell.edges={edges}"]
    write_export(design(load_spec(None, settings)), tmp_path, [SHELL])
    export = read_export(tmp_path)
    assert {"mandrel_a", "mandrel_b"} <= {*drawable(export)}
    (sheet,) = draw_shell(export, "mandrel_b")
    notes = [one for one in sheet.entities if isinstance(one, Text)]
    assert any(one.text.startswith(said) for one in notes)
    frame = [one for one in sheet.entities if isinstance(one, Polyline) and one.closed]
    assert min(one.place[1] for one in notes) > min(y for one in frame for _, y in one.corners)
