"""DXF (R2010): flat drawings in mm at full size, the same bytes every time."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import singledispatch
from io import StringIO
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING

from tbcad.formats.dxf_dimensions import add_dimension
from tbcad.formats.entities import Arc, Circle, Dimension, Entity, Layer, Line, Polyline, Text

if TYPE_CHECKING:
    from ezdxf.layouts import BaseLayout

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


@singledispatch
def _add(entity: Entity, space: "BaseLayout") -> None:
    raise TypeError(entity)


@_add.register(Line)
def _(entity: Line, space: "BaseLayout") -> None:
    space.add_line(entity.start, entity.end, {"layer": entity.layer})


@_add.register(Circle)
def _(entity: Circle, space: "BaseLayout") -> None:
    space.add_circle(entity.centre, entity.radius, {"layer": entity.layer})


@_add.register(Arc)
def _(entity: Arc, space: "BaseLayout") -> None:
    angles = entity.start_deg, entity.end_deg
    space.add_arc(entity.centre, entity.radius, *angles, dxfattribs={"layer": entity.layer})


@_add.register(Polyline)
def _(entity: Polyline, space: "BaseLayout") -> None:
    attributes = {"layer": entity.layer}
    space.add_lwpolyline(entity.corners, close=entity.closed, dxfattribs=attributes)


@_add.register(Text)
def _(entity: Text, space: "BaseLayout") -> None:
    from ezdxf.enums import TextEntityAlignment

    attributes = {"layer": entity.layer}
    text = space.add_text(
        entity.text, height=entity.height, rotation=entity.turn_deg, dxfattribs=attributes
    )
    text.set_placement(entity.place, align=TextEntityAlignment[ALIGNMENTS[entity.align]])


@_add.register(Dimension)
def _(entity: Dimension, space: "BaseLayout") -> None:
    block = add_dimension(entity, space)
    for one in entity.drawn:
        _add(one, block)
