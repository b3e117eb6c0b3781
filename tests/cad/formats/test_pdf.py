"""PDF: its table of places, its numbers, its widths of characters."""

import re
from pathlib import Path

import matplotlib
import pytest

from tbcad.cad.formats.entities import Arc, Circle, Entity, Layer, Line, Polyline, Text
from tbcad.cad.formats.pdf import CAPITAL, text_width, write_pdf

A4 = (297.0, 210.0)
ENTITIES: tuple[Entity, ...] = (
    Line(Layer.CENTRE, (10, 20), (30, 20)),
    Circle(Layer.CUT, (100, 100), 10),
    Arc(Layer.CUT, (50, 50), 5, 350, 20),
    Polyline(Layer.FOLD, ((0, 0), (10, 0), (10, 5))),
    Text(Layer.DIMENSIONS, (60, 60), 3, "4 x Ø3.4 (through)", "centre", 90),
)


@pytest.fixture
def data(tmp_path: Path) -> bytes:
    write_pdf(tmp_path / "one.pdf", "a (test)", A4, ENTITIES)
    return (tmp_path / "one.pdf").read_bytes()


def test_the_table_points_at_the_objects(data: bytes) -> None:
    start = int(re.search(rb"startxref\n(\d+)\n%%EOF\n$", data)[1])  # type: ignore[index]
    assert data[start:].startswith(b"xref\n0 7\n")
    places = re.findall(rb"(\d{10}) 00000 n", data[start:])
    for number, place in enumerate(places, 1):
        assert data[int(place) :].startswith(b"%d 0 obj\n" % number)


def test_the_stream_is_as_long_as_it_says(data: bytes) -> None:
    length, stream = re.search(rb"/Length (\d+)>>\nstream\n(.*)\nendstream", data, re.S).groups()  # type: ignore[union-attr]
    assert int(length) == len(stream)


def test_texts_and_the_page(data: bytes) -> None:
    assert b"(4 x \xd83.4 \\(through\\)) Tj" in data
    box = re.search(rb"/MediaBox\[0 0 ([\d.]+) ([\d.]+)\]", data)
    assert box
    assert [float(side) / 72 * 25.4 for side in box.groups()] == pytest.approx(A4, abs=1e-4)


def test_a_circle_is_round(data: bytes) -> None:
    """Middle of the first of its cubic curves, by its four points."""
    path = re.search(rb"110 100 m ([\d. -]+) c", data)
    assert path
    numbers = [110.0, 100.0, *map(float, path[1].split())]
    for k in (0, 1):
        a, b, c, d = numbers[k::2]
        assert (a + 3 * b + 3 * c + d) / 8 == pytest.approx(100 + 10 / 2**0.5, abs=0.003)


def test_the_same_bytes(tmp_path: Path, data: bytes) -> None:
    write_pdf(tmp_path / "other.pdf", "a (test)", A4, ENTITIES)
    assert (tmp_path / "other.pdf").read_bytes() == data


def test_widths_are_those_of_adobes_metrics() -> None:
    """The file of the core fonts that matplotlib comes with."""
    path = Path(matplotlib.get_data_path(), "fonts", "pdfcorefonts", "Helvetica.afm")
    codes = re.findall(r"^C (\d+) ; WX (\d+) ;", path.read_text(encoding="utf-8"), re.M)
    widths = {chr(int(code)): int(width) for code, width in codes if 32 <= int(code) < 127}
    odd = {"'", "`"}  # other characters in Adobe's own encoding
    for character, width in widths.items():
        if character not in odd:
            assert text_width(character, CAPITAL) == pytest.approx(width / 1000)
