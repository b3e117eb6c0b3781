"""DXF (R2010): flat drawings in mm at full size, the same bytes every time.

Dimensions are entities that measure, each with its picture as a block. It is drawn here and not by
ezdxf, so that every viewer shows what the PDF shows, text by text. Programs that draw dimensions
anew, as LibreCAD and FreeCAD do, find a style that gives nearly the same.
"""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING

from tbcad.cad.formats.entities import (
    Arc,
    Circle,
    Dimension,
    Entity,
    Layer,
    Line,
    Measured,
    Point,
    Polyline,
    Text,
)
from tbcad.cad.formats.pdf import text_width

if TYPE_CHECKING:
    from ezdxf.entities import Dimension as DxfDimension
    from ezdxf.layouts import BaseLayout, BlockLayout

# Height of text, arrow, gap, beyond and above, of the height of the text.
LENGTHS = {"dimtxt": 1.0, "dimasz": 1.0, "dimexo": 1 / 3, "dimexe": 2 / 3, "dimgap": 1 / 3}
MEASURED = "<>"  # stands for what the program measures
PLACED = 128  # of a dimension's type: its text stays where it is
DECIMAL, DECIMAL_POINT = 2, ord(".")  # of $DIMLUNIT and $DIMDSEP
ALONG_LINE = {"dimtih": 0, "dimtoh": 0}  # texts are turned as their line is
AT_END, ABOVE_LINE = 0, 1  # of $DIMTAD
BACK = {"left": 0.0, "centre": 0.5, "right": 1.0}
DIGITS = 9  # of a style's lengths: full size is paper divided by a scale
VERSION = "R2010"
MILLIMETRES = 4  # of $INSUNITS
COLOURS = {  # AutoCAD's numbers; 7 is black on paper and white on a black screen
    Layer.CUT: 7,
    Layer.FOLD: 5,
    Layer.ENGRAVE: 1,
    Layer.HIDDEN: 8,
    Layer.HATCH: 9,
    Layer.RAYS: 3,
    Layer.CENTRE: 4,
    Layer.DIMENSIONS: 8,
    Layer.FRAME: 9,
}
DASHED, CHAIN = "DASHED", "CENTER"  # the names that every program knows
PATTERNS = {  # total length, then dashes and, below zero, gaps, mm
    DASHED: [4.5, 3.0, -1.5],
    CHAIN: [13.0, 8.0, -2.0, 1.0, -2.0],
}
LINETYPES = {Layer.FOLD: DASHED, Layer.HIDDEN: DASHED, Layer.CENTRE: CHAIN}
CLASSES = ("ACDBPLACEHOLDER", "LAYOUT")  # of every drawing; ezdxf orders them by their hashes
_OPTION = RLock()
ALIGNMENTS = {"left": "LEFT", "centre": "CENTER", "right": "RIGHT"}  # in ezdxf


def add_dimension(entity: Dimension, space: "BaseLayout") -> "BlockLayout":
    """Add a dimension; its picture is to be drawn in the block that comes back."""
    assert space.doc is not None
    words = next(one for one in entity.drawn if isinstance(one, Text))
    block = space.doc.blocks.new_anonymous_block(type_char="D")
    dimension = _added(entity, space, _style(entity, space, round(words.height, DIGITS)))
    dimension.dxf.layer = entity.layer
    dimension.dxf.text = dimension_text(entity)
    dimension.dxf.actual_measurement = entity.measured
    dimension.dxf.text_midpoint = _middle(words)
    dimension.dxf.geometry = block.name
    return block


def dimension_text(entity: Dimension) -> str:
    """Its text, with <> where a program that measures writes the number, or a diameter's sign."""
    if f"{entity.measured:.{_digits(entity.size)}f}" != entity.size:
        return entity.form.replace(MEASURED, entity.size)
    is_diameter = entity.kind is Measured.DIAMETER
    return entity.form.replace(f"Ø{MEASURED}", MEASURED) if is_diameter else entity.form


def _added(entity: Dimension, space: "BaseLayout", style: str) -> "DxfDimension":
    if entity.kind is Measured.RUNNING:
        offset = entity.line[0] - entity.end[0], entity.line[1] - entity.end[1]
        return space.add_ordinate_dim(
            entity.end, offset, entity.turn_deg == 0, origin=entity.start, dimstyle=style
        ).dimension
    if entity.kind is Measured.DIAMETER:
        found = space.add_diameter_dim_2p(entity.end, entity.start, dimstyle=style).dimension
    else:
        found = space.add_linear_dim(
            entity.line, entity.start, entity.end, angle=entity.turn_deg, dimstyle=style
        ).dimension
    found.dxf.dimtype |= PLACED
    return found


def _style(entity: Dimension, space: "BaseLayout", height: float) -> str:
    """Name of the style for a height of text and a number of digits, added if it is new."""
    assert space.doc is not None
    digits, styles = _digits(entity.size), space.doc.dimstyles
    running = entity.kind is Measured.RUNNING
    name = f"{'running' if running else 'text'} {height:g} digits {digits}"
    if name not in styles:
        # Numbers are rounded, because ezdxf takes 0, no rounding, for whole numbers.
        numbers = {"dimlunit": DECIMAL, "dimdsep": DECIMAL_POINT, "dimzin": 0, "dimdec": digits}
        place = {"dimrnd": 10.0**-digits, "dimtad": AT_END if running else ABOVE_LINE}
        sizes = {key: share * height for key, share in LENGTHS.items()}
        styles.new(name, dxfattribs={**sizes, **numbers, **place, **ALONG_LINE})
    return name


def _digits(size: str) -> int:
    return len(size.partition(".")[2])


def _middle(text: Text) -> Point:
    turn = math.radians(text.turn_deg)
    along = (0.5 - BACK[text.align]) * text_width(text.text, text.height)
    up = text.height / 2
    return (
        text.place[0] + along * math.cos(turn) - up * math.sin(turn),
        text.place[1] + along * math.sin(turn) + up * math.cos(turn),
    )


def write_dxf(path: Path, entities: Iterable[Entity]) -> None:
    """Write a drawing at full size, with all layers of Layer whether used or not."""
    import ezdxf  # a quarter of a second: only where a drawing is written

    with _fixed_dates():
        document = ezdxf.new(VERSION, units=MILLIMETRES)
        for name, pattern in PATTERNS.items():
            document.linetypes.add(name, pattern)
        for layer in Layer:
            linetype = LINETYPES.get(layer, "Continuous")
            document.layers.add(layer, color=COLOURS[layer], linetype=linetype)
        space = document.modelspace()
        for entity in entities:
            _add(entity, space)
        for name in CLASSES:
            document.classes.add_class(name)
        text = StringIO()
        document.write(text)
    path.write_text(text.getvalue(), encoding="utf-8", newline="\n")


@contextmanager
def _fixed_dates() -> Iterator[None]:
    """Without dates and random identifiers: an option of the process, so threads take turns."""
    import ezdxf

    with _OPTION:
        before = ezdxf.options.write_fixed_meta_data_for_testing
        ezdxf.options.write_fixed_meta_data_for_testing = True
        try:
            yield
        finally:
            ezdxf.options.write_fixed_meta_data_for_testing = before


def _add(entity: Entity, space: "BaseLayout") -> None:
    attributes = {"layer": entity.layer}
    match entity:
        case Line(_, start, end):
            space.add_line(start, end, attributes)
        case Circle(_, centre, radius):
            space.add_circle(centre, radius, attributes)
        case Arc(_, centre, radius, first, last):
            space.add_arc(centre, radius, first, last, dxfattribs=attributes)
        case Polyline(_, corners, closed):
            space.add_lwpolyline(corners, close=closed, dxfattribs=attributes)
        case Text(_, place, height, words, align, turn):
            from ezdxf.enums import TextEntityAlignment

            text = space.add_text(words, height=height, rotation=turn, dxfattribs=attributes)
            text.set_placement(place, align=TextEntityAlignment[ALIGNMENTS[align]])
        case Dimension():
            block = add_dimension(entity, space)
            for one in entity.drawn:
                _add(one, block)
