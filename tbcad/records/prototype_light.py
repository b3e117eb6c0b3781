"""Sections of prototype.json that are of its light: lamps, and the shroud round all."""

from pydantic import Field

from tbcad.cad.formats.checked_files import Finite, Vector
from tbcad.records.document import RecordSection


class LampPlace(RecordSection):
    """A lamp: the middle of its shining face, and the direction that it faces."""

    name: str
    position_mm: Vector
    direction: Vector


class LampsRecord(RecordSection):
    """What lights the object.

    Attributes:
        strip: of LEDs, in the list of parts.
        strips: side by side on each lamp.
        width_mm: of all strips of a lamp side by side.
        level: whether they lie level, else they are upright.
        watt: of all lamps, as is current_ma.
    """

    strip: str
    strips: int
    length_mm: float = Field(gt=0, le=1000)
    width_mm: float = Field(gt=0, le=1000)
    level: bool
    places: tuple[LampPlace, ...] = Field(min_length=1, max_length=100)
    lumen_each: float = Field(gt=0, le=1e6)
    watt: Finite
    current_ma: Finite


class CardPanel(RecordSection):
    """A piece of card: its pattern's file, its width and height without flaps."""

    name: str
    what: str
    dxf: str
    size_mm: tuple[Finite, Finite]


class ShroudRecord(RecordSection):
    """The box of card round the machine."""

    sheet: str
    sheets: int
    finish: str
    panels: tuple[CardPanel, ...]
