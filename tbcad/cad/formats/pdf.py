"""PDF 1.4 (ISO 32000) of a flat drawing: lines and Helvetica, the same bytes every time.

Written here because importing a plotting library takes as long as ten drawings.
"""

import csv
import math
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path

from tbcad.cad.formats.entities import (
    Arc,
    Circle,
    Entity,
    Layer,
    Line,
    Point,
    Polyline,
    Simple,
    Text,
    simple,
)

POINTS_PER_MM = 72 / 25.4
THICK_MM, THIN_MM, FINE_MM = 0.5, 0.25, 0.13  # lines by ISO 128; of hatching and many rays
WIDTHS = {
    **{Layer.CUT: THICK_MM, Layer.FRAME: THICK_MM},
    **{Layer.HIDDEN: 0.18, Layer.HATCH: FINE_MM, Layer.RAYS: FINE_MM},
}
DASHES = {Layer.FOLD: "[3 1.5]", Layer.HIDDEN: "[2 1]", Layer.CENTRE: "[8 2 1 2]"}  # mm
FONT = "<</Type/Font/Subtype/Type1/BaseFont/Helvetica/Encoding/WinAnsiEncoding>>"
EM = 1000.0  # units of the font's widths
CAPITAL = 0.718  # height of capital letters in Helvetica, of its size
QUARTER = math.pi / 2
ALIGNED = {"left": 0.0, "centre": 0.5, "right": 1.0}  # share of the width before the place


@cache
def _widths() -> dict[str, float]:
    """Widths of characters in Helvetica, as in Adobe's metrics of the 14 standard fonts."""
    table = (files("tbcad.cad.formats") / "helvetica.csv").read_text(encoding="utf-8")
    rows = csv.reader(table.splitlines()[1:])
    return {character: float(width) for character, width in rows}


def text_width(text: str, height: float) -> float:
    """Width of a text by the height of its capitals, mm; KeyError if drawings lack a character."""
    return sum(_widths()[character] for character in text) / EM * height / CAPITAL


def drawable(text: str) -> str:
    """A text with a question mark for each character that drawings lack."""
    return "".join(one if one in _widths() else "?" for one in text)


def write_pdf(
    path: Path, title: str, size: tuple[float, float], entities: Iterable[Entity]
) -> None:
    """Write one page of a size (mm) with a title; entities are in mm from its lower left corner."""
    write_pages(path, title, size, [entities])


def write_pages(
    path: Path, title: str, size: tuple[float, float], pages: Sequence[Iterable[Entity]]
) -> None:
    """Write pages of a size (mm) with a title; entities as in `write_pdf`."""
    box = " ".join(_number(side * POINTS_PER_MM) for side in size)
    # The first page is object 3 and its contents are 5; each other page has the next two.
    numbers = [3, *(2 * k + 4 for k in range(1, len(pages)))]
    kids = " ".join(f"{number} 0 R" for number in numbers)
    objects = [
        "<</Type/Catalog/Pages 2 0 R>>",
        f"<</Type/Pages/Kids[{kids}]/Count {len(pages)}>>",
    ]
    for number, entities in zip(numbers, pages, strict=True):
        contents = number + (2 if number == numbers[0] else 1)
        objects.append(
            f"<</Type/Page/Parent 2 0 R/MediaBox[0 0 {box}]/Contents {contents} 0 R"
            "/Resources<</Font<</F1 4 0 R>>>>>>"
        )
        objects += [FONT] if number == numbers[0] else []
        objects.append(_contents(entities))
    path.write_bytes(_file([*objects, f"<</Title({_escaped(title)})>>"]))


def _contents(entities: Iterable[Entity]) -> str:
    scale = _number(POINTS_PER_MM)
    drawn = "\n".join(["1 J 1 j", f"{scale} 0 0 {scale} 0 0 cm", *map(_styled, simple(entities))])
    return f"<</Length {len(_encoded(drawn))}>>\nstream\n{drawn}\nendstream"


def _file(objects: Sequence[str]) -> bytes:
    """Header, numbered objects, table of their places, and trailer."""
    data, places = b"%PDF-1.4\n", []
    for number, text in enumerate(objects, 1):
        places.append(len(data))
        data += _encoded(f"{number} 0 obj\n{text}\nendobj\n")
    count, start = len(objects) + 1, len(data)
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    trailer = f"<</Size {count}/Root 1 0 R/Info {len(objects)} 0 R>>"
    end = f"xref\n0 {count}\n0000000000 65535 f \n{table}trailer\n{trailer}\nstartxref\n{start}\n"
    return data + _encoded(end + "%%EOF\n")


def _encoded(text: str) -> bytes:
    return text.encode("cp1252")


def _number(value: float) -> str:
    return f"{value + 0.0:.4f}".rstrip("0").rstrip(".")


def _point(point: Point) -> str:
    return f"{_number(point[0])} {_number(point[1])}"


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")


def _styled(entity: Simple) -> str:
    if isinstance(entity, Text):
        return _text(entity)
    width, dash = WIDTHS.get(entity.layer, THIN_MM), DASHES.get(entity.layer, "[]")
    return f"{_number(width)} w {dash} 0 d {_path(entity)} S"


def _text(entity: Text) -> str:
    turn = math.radians(entity.turn_deg)
    along = math.cos(turn), math.sin(turn)
    back = ALIGNED[entity.align] * text_width(entity.text, entity.height)
    place = entity.place[0] - back * along[0], entity.place[1] - back * along[1]
    matrix = f"{_point(along)} {_point((-along[1], along[0]))} {_point(place)} Tm"
    size = _number(entity.height / CAPITAL)
    return f"BT /F1 {size} Tf {matrix} ({_escaped(entity.text)}) Tj ET"


def _path(entity: Line | Polyline | Circle | Arc) -> str:
    match entity:
        case Line(_, start, end):
            return f"{_point(start)} m {_point(end)} l"
        case Polyline(_, corners, closed):
            first, *others = map(_point, corners)
            return " ".join([f"{first} m", *(f"{one} l" for one in others), *("h" * closed)])
        case Circle(_, centre, radius):
            return _curve(centre, radius, 0.0, 2 * math.pi)
        case Arc(_, centre, radius, first_deg, last_deg):
            turn = math.radians((last_deg - first_deg) % 360)
            return _curve(centre, radius, math.radians(first_deg), turn)


def _curve(centre: Point, radius: float, start: float, turn: float) -> str:
    """Cubic curves of at most a quarter each; they are off by 0.03 % of the radius."""
    pieces = max(math.ceil(turn / QUARTER - 1e-9), 1)
    step = turn / pieces
    handle = 4 / 3 * math.tan(step / 4) * radius

    def at(angle: float, along: float = 0.0) -> str:
        x, y = math.cos(angle), math.sin(angle)
        return _point((centre[0] + radius * x - along * y, centre[1] + radius * y + along * x))

    angles = [(start + k * step, start + (k + 1) * step) for k in range(pieces)]
    curves = [f"{at(a, handle)} {at(b, -handle)} {at(b)} c" for a, b in angles]
    return " ".join([f"{at(start)} m", *curves])
