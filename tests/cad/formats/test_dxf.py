"""DXF: read back by a reader of its own, and the same bytes every time."""

import math
import os
import subprocess
import sys
from pathlib import Path

from tbcad.cad.formats.dxf import write_dxf
from tbcad.cad.formats.entities import Arc, Circle, Entity, Layer, Line, Polyline, Text

ENTITIES: tuple[Entity, ...] = (
    Line(Layer.CENTRE, (-1.5, 0.0), (30.0, 0.125)),
    Circle(Layer.CUT, (10.0, 20.0), 2.1),
    Arc(Layer.CUT, (1.0, 2.0), 7.0, 350.0, 20.0),
    Polyline(Layer.FOLD, ((0.0, 0.0), (100.0, 0.0), (100.0, 50.0))),
    Text(Layer.ENGRAVE, (5.0, 6.0), 3.5, "Ø 4,2 mm", "centre", 90.0),
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
    """No date, no random identifier."""
    import ezdxf

    before = ezdxf.options.write_fixed_meta_data_for_testing
    for name in ("one.dxf", "other.dxf"):
        write_dxf(tmp_path / name, ENTITIES)
    assert (tmp_path / "one.dxf").read_bytes() == (tmp_path / "other.dxf").read_bytes()
    assert ezdxf.options.write_fixed_meta_data_for_testing == before


def test_the_bytes_do_not_depend_on_hashes(tmp_path: Path) -> None:
    """Sets of texts come in another order in each process."""
    code = (
        "import sys; from pathlib import Path; from tbcad.cad.formats.dxf import write_dxf;"
        "write_dxf(Path(sys.argv[1]), [])"
    )
    for seed in ("0", "1", "2", "3"):
        file = tmp_path / f"{seed}.dxf"
        variables = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run([sys.executable, "-c", code, str(file)], env=variables, check=True)
    assert len({file.read_bytes() for file in tmp_path.iterdir()}) == 1
