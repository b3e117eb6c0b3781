"""DXF: read back by a reader of its own, and the same bytes every time."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest

from tbcad.cad.formats.dxf import write_dxf
from tbcad.cad.formats.entities import Arc, Circle, Entity, Layer, Line, Polyline, Text
from tbcad.cad.formats.pdf import CAPITAL, text_width, write_pdf

ENTITIES: tuple[Entity, ...] = (
    Line(Layer.CENTRE, (-1.5, 0.0), (30.0, 0.125)),
    Circle(Layer.CUT, (10.0, 20.0), 2.1),
    Arc(Layer.CUT, (1.0, 2.0), 7.0, 350.0, 20.0),
    Polyline(Layer.FOLD, ((0.0, 0.0), (100.0, 0.0), (100.0, 50.0))),
    Text(Layer.ENGRAVE, (5.0, 6.0), 3.5, "Ø 4,2 mm", "centre", 90.0),
)
A4 = (297.0, 210.0)
PDF_ENTITIES: tuple[Entity, ...] = (
    Line(Layer.CENTRE, (10, 20), (30, 20)),
    Circle(Layer.CUT, (100, 100), 10),
    Arc(Layer.CUT, (50, 50), 5, 350, 20),
    Polyline(Layer.FOLD, ((0, 0), (10, 0), (10, 5))),
    Text(Layer.DIMENSIONS, (60, 60), 3, "4 x Ø3.4 (through)", "centre", 90),
)


def entities(path: Path) -> list[dict[int, list[str]]]:
    """The entities of a file, by group codes, read without ezdxf."""
    lines = path.read_text("utf-8").split("\n")
    pairs = [(int(code), value) for code, value in zip(lines[::2], lines[1::2], strict=False)]
    begin = pairs.index((2, "ENTITIES"))
    found: list[dict[int, list[str]]] = []
    for code, value in pairs[begin + 1 : pairs.index((0, "ENDSEC"), begin)]:
        if code == 0:
            found.append({})
        found[-1].setdefault(code, []).append(value)
    return found


def test_every_entity_is_in_the_file_at_full_size(tmp_path: Path) -> None:
    """Coordinates, layers, angles and closing are those given."""
    write_dxf(tmp_path / "some.dxf", ENTITIES)
    line, circle, arc, polyline, text = entities(tmp_path / "some.dxf")
    assert (line[0], line[8]) == (["LINE"], ["centre"])
    assert [float(line[code][0]) for code in (10, 20, 11, 21)] == [-1.5, 0.0, 30.0, 0.125]
    assert [float(circle[code][0]) for code in (10, 20, 40)] == [10.0, 20.0, 2.1]
    assert [float(arc[code][0]) for code in (40, 50, 51)] == [7.0, 350.0, 20.0]
    assert (polyline[70], polyline[8]) == (["1"], ["fold"])
    assert [*map(float, polyline[10])] == [0.0, 100.0, 100.0]
    assert text[1] == ["Ø 4,2 mm"]
    assert math.isclose(float(text[50][0]), 90.0)


def test_units_and_layers_are_declared(tmp_path: Path) -> None:
    """Millimetres (4) by $INSUNITS, and every layer also where nothing is on it."""
    write_dxf(tmp_path / "empty.dxf", ())
    lines = [line.strip() for line in (tmp_path / "empty.dxf").read_text("utf-8").split("\n")]
    assert lines[lines.index("$INSUNITS") + 2] == "4"
    assert {*Layer} <= {*lines}


def test_the_same_drawing_has_the_same_bytes(tmp_path: Path) -> None:
    """No date, no random identifier, no order of a set of texts, another one in each process."""
    import ezdxf

    before = ezdxf.options.write_fixed_meta_data_for_testing
    write_dxf(tmp_path / "here.dxf", ENTITIES)
    assert ezdxf.options.write_fixed_meta_data_for_testing == before
    code = (
        "import sys; from pathlib import Path; from tests.cad.formats.test_dxf import *;"
        "write_dxf(Path(sys.argv[1]), ENTITIES)"
    )
    for seed in ("0", "1"):
        command = [sys.executable, "-c", code, str(tmp_path / f"{seed}.dxf")]
        variables = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run(command, env=variables, check=True, cwd=Path(__file__).parents[3])
    assert len({file.read_bytes() for file in tmp_path.iterdir()}) == 1


@pytest.fixture
def data(tmp_path: Path) -> bytes:
    write_pdf(tmp_path / "one.pdf", "a (test)", A4, PDF_ENTITIES)
    return (tmp_path / "one.pdf").read_bytes()


def test_the_table_points_at_the_objects(data: bytes) -> None:
    start = int(re.search(rb"startxref\n(\d+)\n%%EOF\n$", data)[1])  # type: ignore[index]
    assert data[start:].startswith(b"xref\n0 7\n")
    places = re.findall(rb"(\d{10}) 00000 n", data[start:])
    for number, place in enumerate(places, 1):
        assert data[int(place) :].startswith(b"%d 0 obj\n" % number)


def test_texts_and_the_page_in_the_same_bytes(tmp_path: Path, data: bytes) -> None:
    write_pdf(tmp_path / "other.pdf", "a (test)", A4, PDF_ENTITIES)
    assert (tmp_path / "other.pdf").read_bytes() == data
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


def test_widths_are_those_of_adobes_metrics() -> None:
    """The file of the core fonts that matplotlib comes with."""
    path = Path(matplotlib.get_data_path(), "fonts", "pdfcorefonts", "Helvetica.afm")
    codes = re.findall(r"^C (\d+) ; WX (\d+) ;", path.read_text(encoding="utf-8"), re.M)
    widths = {chr(int(code)): int(width) for code, width in codes if 32 <= int(code) < 127}
    odd = {"'", "`"}  # other characters in Adobe's own encoding
    for character, width in widths.items():
        if character not in odd:
            assert text_width(character, CAPITAL) == pytest.approx(width / 1000)
