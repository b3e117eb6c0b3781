"""Sheets of parts: sizes and holes of the solid, read back from the DXF by ezdxf."""

import math
from collections import Counter
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from OCP.TopoDS import TopoDS_Shape

from tbcad.cad.drafting.sheet import BORDER_MM, TITLE_MM, Sheet, TitleBlock
from tbcad.cad.drafting.views import ABOVE, FRONT, Curve, project, section
from tbcad.cad.formats.entities import Circle, Layer, Line
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.features import bounds, cylinders, plane_levels
from tbcad.cad.kernel.solids import cut, cylinder, faces, moved, one_solid, polygon, prism
from tbcad.drawings.part_sheet import part_datum, part_sheets
from tbcad.drawings.tables import numbered_holes
from tests.sheet_texts import check_texts, covered, texts

SIZE = np.array([60.0, 40.0, 8.0])
THROUGH, BLIND, DEEP, TILT = (10.0, 10.0), (50.0, 30.0), 5.0, math.radians(30)
X, Y, Z = np.eye(3)
NAME, WORDS = "bracket", ("A.",)
BLOCK = TitleBlock("bracket", "some, n = 6", "7: bracket", 2, "PETG")


def stadium(x: float, y: float, radius: float, length: float) -> list[TopoDS_Shape]:
    """A slot along x through the plate: two cylinders and a box."""
    low = np.array([[x, y - radius, -1], [x + length, y - radius, -1]])
    corners = np.vstack([low, low[::-1] + 2 * radius * Y])
    ends = [cylinder(np.array([at, y, -1.0]), Z, radius, 10.0) for at in (x, x + length)]
    return [*ends, prism(polygon(corners), 10.0 * Z)]


@pytest.fixture(scope="module")
def bracket() -> Solid:
    """A plate with a hole of 5 mm, a blind one of 6 mm, a slot 4 x 14 and one tilted by 30 deg."""
    corners = np.array([[0, 0, 0], [60, 0, 0], [60, 40, 0], [0, 40, 0]], dtype=np.float64)
    tools = [
        cylinder(np.array([*THROUGH, -1.0]), Z, 2.5, 10.0),
        cylinder(np.array([*BLIND, 8.0 - DEEP]), Z, 3.0, DEEP + 1),
        cylinder(
            np.array([30.0, 30.0, 4.0]) - 10 * np.array([0, math.sin(TILT), math.cos(TILT)]),
            np.array([0, math.sin(TILT), math.cos(TILT)]),
            1.5,
            20.0,
        ),
        *stadium(25.0, 10.0, 2.0, 10.0),
    ]
    shape = one_solid("bracket", cut(prism(polygon(corners), 8.0 * Z), tools))
    return Solid("bracket", shape, tuple((f"f{k}", one) for k, one in enumerate(faces(shape))))


@pytest.fixture(scope="module")
def sheet(bracket: Solid) -> Sheet:
    screw = ("M5x16", np.array([*THROUGH, 12.0]), -Z)
    (only,) = part_sheets(NAME, bracket.shape, BLOCK, WORDS, [screw])
    return only


def ends(curves: tuple[Curve, ...]) -> list[tuple[float, float]]:
    return [end for one in curves if isinstance(one, Line) for end in (one.start, one.end)]


def test_bounds_and_levels(bracket: Solid) -> None:
    assert bounds(bracket.shape) == pytest.approx(np.array([np.zeros(3), SIZE]), abs=1e-6)
    assert [level for level, _ in plane_levels(bracket.shape, Z)] == [0.0, 3.0, 8.0]
    assert dict(plane_levels(bracket.shape, X))[0.0] == pytest.approx(40 * 8)


def test_holes_are_found_with_their_ends(bracket: Solid) -> None:
    screw = ("M5x16", np.array([*THROUGH, 12.0]), -Z)
    holes = dict(numbered_holes(cylinders(bracket.shape), [screw]))
    assert list(holes) == ["B1", "B2", "B3", "T1"]
    assert holes["B1"].through
    assert holes["B1"].takes == "M5x16"
    assert holes["B1"].mouth == pytest.approx([*THROUGH, 8.0])
    assert holes["B2"].mouth == pytest.approx([30.0, 10.0, 8.0])
    assert np.abs(holes["B2"].slot) == pytest.approx([10.0, 0.0, 0.0])
    assert not holes["B3"].through
    assert holes["B3"].cylinder.length == pytest.approx(DEEP)
    assert holes["T1"].is_tilted
    assert holes["T1"].through
    assert abs(holes["T1"].cylinder.axis[2]) == pytest.approx(math.cos(TILT))


def test_a_view_from_above_has_the_holes_as_circles(bracket: Solid) -> None:
    seen = project(bracket.shape, ABOVE)
    circles = {(one.centre, one.radius) for one in seen.visible if isinstance(one, Circle)}
    assert circles == {(THROUGH, 2.5), (BLIND, 3.0)}
    for end in ((0.0, 40.0), (60.0, 0.0)):
        assert Line(Layer.CUT, (0.0, 0.0), end) in seen.visible


def test_a_blind_hole_is_hidden_from_the_front(bracket: Solid) -> None:
    seen = project(bracket.shape, FRONT)
    bottom = [x for x, z in ends(seen.hidden) if abs(z - 3.0) < 1e-4 and x > 40]
    assert (min(bottom), max(bottom)) == pytest.approx((47.0, 53.0), abs=1e-4)
    assert {round(z, 4) for _, z in ends(seen.visible)} == {0.0, 8.0}


def test_a_section_is_where_the_plane_cuts(bracket: Solid) -> None:
    cuts = section(bracket.shape, FRONT, -10.0)  # y = 10, through the hole and the slot
    assert {x for x, _ in ends(cuts)} == {0.0, 7.5, 12.5, 23.0, 37.0, 60.0}


def test_lengths_and_table_are_the_solids(sheet: Sheet) -> None:
    words = [one.text for one in texts(sheet)]
    assert {"60", "40", "8"} <= set(words)
    for number, cells in {
        "B1": ("5", "10.00", "through", "M5x16"),
        "B2": ("4", "30.00", "through", "slot 4 x 14"),
        "B3": ("6", "50.00", "5"),
        "T1": ("3", "through"),
    }.items():
        row = words[words.index("hole") :]
        start = max(k for k, word in enumerate(row) if word == number)
        assert set(cells) <= set(row[start : start + 7]), number


def test_no_text_meets_another_or_the_border(sheet: Sheet) -> None:
    check_texts(sheet)


def test_the_table_goes_on_on_other_sheets() -> None:
    corners = np.array([[0, 0, 0], [100, 0, 0], [100, 60, 0], [0, 60, 0]], dtype=np.float64)
    places = [(x, y) for x in range(5, 100, 10) for y in range(5, 60, 10)]
    tools = [cylinder(np.array([x, y, -1.0]), Z, 1.0, 10.0) for x, y in places]
    plate = cut(prism(polygon(corners), 4.0 * Z), tools)
    sheets = part_sheets(NAME, plate, BLOCK, WORDS, [])
    assert [one.name for one in sheets] == ["bracket", "bracket_2"]
    numbers = {text.text for one in sheets for text in texts(one)}
    assert {f"B{k}" for k in range(1, len(places) + 1)} <= numbers
    assert min(covered(one)[1] for one in texts(sheets[1]) if one.text[:1] == "B") > (
        BORDER_MM + TITLE_MM[1]
    )


def test_the_dxf_is_at_full_size_from_the_datum(bracket: Solid, tmp_path: Path) -> None:
    turned = np.array([Y, -X, Z])  # x becomes y of the drawing
    shape = moved(bracket.shape, turned, np.zeros(3))
    datum, what = part_datum(shape, np.array([-10.0, 10.0, 0.0]), {"axis of it": Z})  # a hole's
    assert what == "axis of it, lowest face"
    (drawing,) = part_sheets(NAME, moved(shape, np.eye(3), -datum), BLOCK, WORDS, [])
    folders = [tmp_path / "one", tmp_path / "other"]
    for folder in folders:
        folder.mkdir()
        drawing.write(folder)
    for name in ("bracket.pdf", "bracket.dxf"):
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()
    document = ezdxf.readfile(folders[0] / "bracket.dxf")
    layers = {layer.dxf.name for layer in document.layers}
    assert {"cut", "hidden", "centre", "dimensions", "frame"} <= layers
    assert document.layers.get("hidden").dxf.linetype == "DASHED"
    lines = document.modelspace().query('LINE[layer=="cut"]')
    front = {round(x, 4) for one in lines for x, y in [one.dxf.start.vec2] if abs(y) < 1e-6}
    assert {-30.0, 10.0} <= front  # the plate's 40 mm, from the axis of the hole
    circles = document.modelspace().query('CIRCLE[layer=="cut"]')
    assert sorted({round(one.dxf.radius, 4) for one in circles}) == [2.5, 3.0]
    dimensions = list(document.modelspace().query("DIMENSION"))
    assert all("<>" in one.dxf.text for one in dimensions)
    measured = Counter(round(one.dxf.actual_measurement, 4) for one in dimensions)
    # Lengths over all; levels of the plate's ends from the datum, and of the slots' ends.
    assert measured >= Counter([60.0, 40.0, 8.0, 30.0, 10.0, 10.0, 50.0, 0.0, 8.0])
