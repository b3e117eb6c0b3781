"""What is cut of a DXF: circles and outlines of one layer, and no more of them than a part has."""

from __future__ import annotations

import io

import pytest
from ezdxf.document import Drawing
from ezdxf.units import IN, MM
from tbcad_verify.prototype.flat_drawing import read_dxf
from tbcad_verify.report.checks import Unknown


def drawing(circles: int, units: int = MM, layer: str = "centre") -> str:
    """A DXF with circles and a square to be cut, and a circle that only shows something."""
    document = Drawing.new("R2010")
    document.units = units
    space = document.modelspace()
    for k in range(circles):
        space.add_circle((k, 2), 0.5, dxfattribs={"layer": "cut"})
    space.add_circle((9, 9), 9, dxfattribs={"layer": layer})
    space.add_lwpolyline([(0, 0), (3, 0), (3, 4), (0, 4)], dxfattribs={"layer": "cut"})
    text = io.StringIO()
    document.write(text)
    return text.getvalue()


def test_what_is_cut_is_read() -> None:
    flat = read_dxf(drawing(2))
    assert flat.circles.tolist() == [[0, 2, 0.5], [1, 2, 0.5]]
    assert flat.corners.tolist() == [[0, 0], [3, 0], [3, 4], [0, 4]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (drawing(1001), "1001 circles"),
        (drawing(2, IN), "not in millimetres"),
        (drawing(2, layer="cuts"), "a layer cuts"),
        ("plate", "is no DXF"),
    ],
)
def test_anything_else_is_not_read(text: str, words: str) -> None:
    with pytest.raises(Unknown, match=words):
        read_dxf(text)
