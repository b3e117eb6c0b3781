"""Dimensions in DXF: entities that measure what they say, with a picture for every viewer."""

from pathlib import Path
from typing import Any

import ezdxf
import pytest
from ezdxf.document import Drawing

from tbcad.cad.drafting.dimensions import across, diameter, ruler_across, ruler_upward, upward
from tbcad.cad.formats.dxf import write_dxf
from tbcad.cad.formats.entities import Circle, Layer, simple
from tbcad.cad.formats.pdf import write_pdf

CIRCLE = Circle(Layer.CUT, (50.0, 50.0), 10.0)
LEVELS = ((-30.0, "-30"), (0.0, "0"), (40.25, "40.25"))
DIMENSIONS = (
    across((0.0, 3.0), (60.0, 0.0), -14.0, "60"),
    upward((0.0, 0.0), (2.0, 3.25), -14.0, "3.25", "(<>)"),
    diameter(CIRCLE, (56.0, 58.0), (80.0, 80.0), "20", "4 x Ø<>"),
    *ruler_across(LEVELS, 0.0, 0.0, -20.0),
    *ruler_upward(LEVELS, 0.0, 0.0, -20.0),
)
SAID = ["60", "(3.25)", "4 x Ø20", *2 * ["-30", "0", "40.25"]]
MEASURED = [60.0, 3.25, 20.0, *2 * [30.0, 0.0, 40.25]]


@pytest.fixture(scope="module")
def document(tmp_path_factory: pytest.TempPathFactory) -> Drawing:
    path = tmp_path_factory.mktemp("dxf") / "some.dxf"
    write_dxf(path, [CIRCLE, *DIMENSIONS])
    return ezdxf.readfile(path)


def dimensions(document: Drawing) -> list[Any]:
    return list(document.modelspace().query("DIMENSION"))


def shown(dimension: Any) -> str:
    (text,) = (one for one in dimension.virtual_entities() if one.dxftype() == "TEXT")
    return str(text.dxf.text)


def test_every_dimension_is_one_in_the_file(document: Drawing) -> None:
    found = dimensions(document)
    assert [one.dimtype for one in found] == [0, 0, 3, *6 * [6]]
    assert {one.dxf.layer for one in found} == {"dimensions"}
    assert not document.modelspace().query("TEXT LINE")
    audit = document.audit()
    assert not audit.errors
    assert not audit.fixes


def test_it_measures_what_it_says(document: Drawing) -> None:
    """By another program's definition of each kind, from the points in the file."""
    for one, measured in zip(dimensions(document), MEASURED, strict=True):
        value = one.get_measurement()
        if one.dimtype == 6:
            x_type = one.dxf.dimtype & 64
            value = abs(value.x if x_type else value.y)
        assert value == pytest.approx(measured)
        assert one.dxf.actual_measurement == pytest.approx(measured)


def test_its_picture_is_that_of_the_pdf(document: Drawing) -> None:
    found = dimensions(document)
    assert [shown(one) for one in found] == SAID
    for one, dimension in zip(found, DIMENSIONS, strict=True):
        kinds = {"Line": "LINE", "Polyline": "LWPOLYLINE", "Text": "TEXT"}
        drawn = [kinds[type(part).__name__] for part in dimension.drawn]
        assert [part.dxftype() for part in one.virtual_entities()] == drawn
        assert {part.dxf.layer for part in one.virtual_entities()} == {"dimensions"}


def test_a_program_that_draws_it_anew_writes_the_same(document: Drawing) -> None:
    """ezdxf's own picture, by the text with its place for the number, and the style."""
    for one, said in zip(dimensions(document), SAID, strict=True):
        assert "<>" in one.dxf.text
        before = one.dxf.geometry
        one.render()
        (text,) = (part for part in one.virtual_entities() if part.dxftype() == "MTEXT")
        one.dxf.geometry = before
        assert text.plain_text() == said
        assert text.dxf.char_height == pytest.approx(2.5 if one.dimtype == 6 else 3.0)


def test_a_number_that_is_not_measured_stays_as_it_is(tmp_path: Path) -> None:
    """A sheet that is not to scale, or a number at a tie of rounding."""
    write_dxf(tmp_path / "other.dxf", [across((0.0, 0.0), (60.0, 0.0), -14.0, "61", "Ø<>")])
    (one,) = dimensions(ezdxf.readfile(tmp_path / "other.dxf"))
    assert one.dxf.text == "Ø61"


def test_the_pdf_has_lines_and_texts(tmp_path: Path) -> None:
    write_pdf(tmp_path / "some.pdf", "some", (100.0, 100.0), DIMENSIONS)
    write_pdf(tmp_path / "flat.pdf", "some", (100.0, 100.0), [*simple(DIMENSIONS)])
    data = (tmp_path / "some.pdf").read_bytes()
    assert data == (tmp_path / "flat.pdf").read_bytes()
    assert data.count(b" Tj") == len(DIMENSIONS)
