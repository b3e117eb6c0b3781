"""A sheet: border, title block, notes, and a part drawn to scale (ISO 5455, 5457, 7200)."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from tbcad.cad.formats.dxf import write_dxf
from tbcad.cad.formats.entities import (
    Arc,
    Circle,
    Dimension,
    Entity,
    Layer,
    Line,
    Point,
    Polyline,
    Text,
    simple,
)
from tbcad.cad.formats.pdf import text_width, write_pdf
from tbcad.version import __version__

A3, A4 = (420.0, 297.0), (297.0, 210.0)
LEFT_MM, BORDER_MM = 20.0, 10.0  # of the border from the paper's edges; left for filing
SCALES = (5.0, 2.0, 1.0, 0.5, 0.2, 0.1)
TITLE_MM, ROW_MM = (180.0, 36.0), 12.0  # of the title block
SYMBOL_MM = 20.0  # from the symbol's middle to the end of its cell
LABEL_MM, VALUE_MM, NOTE_MM = 1.8, 3.0, 3.0  # heights of texts
INSIDE_MM = 1.5  # of a cell's texts from its border
LINE_MM = 5.5  # from note to note
BESIDE_MM = 4.0  # of notes and tables from a border
TOLERANCES = "ISO 2768-m"
FIRST_ANGLE = "first angle (ISO 5456-2)"
Box: TypeAlias = tuple[float, float, float, float]  # left, bottom, right, top, mm
TABLE_ROW_MM, TEXT_MM, CELL_MM = 5.0, 2.5, 1.5  # height of rows and texts, room before a text
LEAST_MM = 1.6  # height of a text that is read without a lens


@dataclass(frozen=True)
class TitleBlock:
    """What the title block says."""

    title: str  # of the drawing
    design: str  # that the part belongs to
    item: str  # number and name in the parts list
    quantity: int  # of the part
    material: str  # of it
    view: str = ""  # from where it is seen; empty for several views, in first-angle projection
    sheet: str = "1 of 1"  # number of this sheet and of all of the drawing
    tolerances: str = TOLERANCES  # of what has none of its own


@dataclass(frozen=True)
class Sheet:
    """A drawing."""

    name: str  # of its files
    title: str  # in words
    part: str  # that it shows, by its name in the parts list
    paper: tuple[float, float]  # size, mm
    scale: float  # of the part on paper
    origin: Point  # of the part's coordinates on paper, mm
    entities: tuple[Entity, ...]  # on paper, mm
    to_scale: bool = True  # whether anything is

    @classmethod
    def framed(
        cls,
        names: tuple[str, str],
        block: TitleBlock,
        paper: Point,
        scale: float | None,
        origin: Point,
        drawn: Iterable[Entity],
        words: Sequence[str] = (),
    ) -> "Sheet":
        """A sheet with its frame and words beside the title; names are of its files and part.

        Without a scale nothing is to scale.
        """
        beside = notes_beside_title(paper, words) if words else ()
        entities = (*sheet_frame(paper, scale, block), *drawn, *beside)
        name, part = names
        on_paper = paper, scale or 1.0, origin, entities, scale is not None
        return cls(name, block.title, part, *on_paper)

    def full_size(self) -> list[Entity]:
        """All entities with the part at full size and its origin at (0, 0)."""
        return [moved(entity, self.origin, 1 / self.scale) for entity in self.entities]

    def write(self, folder: Path) -> None:
        """Write the PDF to scale, and the DXF at full size."""
        write_pdf(folder / f"{self.name}.pdf", self.title, self.paper, self.entities)
        write_dxf(folder / f"{self.name}.dxf", self.full_size())


def choose_scale(size: Point, room: Point, scales: Sequence[float] = SCALES) -> float:
    """The first, largest scale at which a size (mm) fits into a room on paper (mm), or the last."""
    fitting = (one for one in scales if size[0] * one <= room[0] and size[1] * one <= room[1])
    return next(fitting, scales[-1])


def scale_text(scale: float) -> str:
    """Such as 1:2."""
    return f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"


def paper_name(paper: Point) -> str:
    """A3 or A4."""
    return "A3" if paper == A3 else "A4"


def drawing_room(paper: Point) -> Box:
    """What border and title block leave."""
    return LEFT_MM, BORDER_MM + TITLE_MM[1], paper[0] - BORDER_MM, paper[1] - BORDER_MM


def rectangle(box: Box, layer: Layer) -> Polyline:
    """The outline of a box."""
    left, low, right, high = box
    return Polyline(layer, ((left, low), (right, low), (right, high), (left, high)))


def sheet_frame(paper: Point, scale: float | None, block: TitleBlock) -> Iterator[Entity]:
    """Border, and title block in the lower right corner; without a scale nothing is to scale."""
    yield rectangle((LEFT_MM, BORDER_MM, paper[0] - BORDER_MM, paper[1] - BORDER_MM), Layer.FRAME)
    shown = f"{scale_text(scale)} on {paper_name(paper)}" if scale else "not to scale"
    seen = ("Single view", block.view) if block.view else ("Projection", FIRST_ANGLE)
    rows = (
        (70.0, "Title", block.title),
        (50.0, "Item of bom.csv", block.item),
        (60.0, "Design", block.design),
        (70.0, "Material", block.material),
        (50.0, "General tolerances", block.tolerances),
        (60.0, "Scale on this paper", shown),
        (20.0, "Quantity", f"{block.quantity}"),
        (15.0, "Units", "mm"),
        (20.0, "Sheet", block.sheet),
        (75.0, *seen),
        (50.0, "Drawn by", f"tbcad {__version__}"),
    )
    start = paper[0] - BORDER_MM - TITLE_MM[0]
    left, low = start, BORDER_MM + TITLE_MM[1] - ROW_MM
    for width, label, value in rows:
        yield from cell((left, low, left + width, low + ROW_MM), label, value)
        if value is FIRST_ANGLE:
            yield from _first_angle((left + width - SYMBOL_MM, low + ROW_MM / 2))
        left += width
        if left > start + TITLE_MM[0] - 1.0:
            left, low = start, low - ROW_MM


def _first_angle(middle: Point) -> Iterator[Entity]:
    """The symbol of first-angle projection: a cone from the side, left of it from its thin end."""
    x, y = middle
    thin, thick, half = 1.6, 3.2, 3.5  # radii of the cone, half its length
    ends = (x - half, y - thin), (x + half, y - thick), (x + half, y + thick), (x - half, y + thin)
    yield Polyline(Layer.FRAME, ends)
    yield Line(Layer.CENTRE, (x - half - 1.0, y), (x + half + 1.0, y))
    right = x + half + 2.0 + thick
    for radius in (thin, thick):
        yield Circle(Layer.FRAME, (right, y), radius)
    yield Line(Layer.CENTRE, (right - thick - 1.0, y), (right + thick + 1.0, y))
    yield Line(Layer.CENTRE, (right, y - thick - 1.0), (right, y + thick + 1.0))


def cell(box: Box, label: str, value: str) -> Iterator[Entity]:
    """A cell of a title block: what it is above what it says."""
    yield rectangle(box, Layer.FRAME)
    left, low, right, high = box
    room = right - left - 2 * INSIDE_MM
    top = (left + INSIDE_MM, high - INSIDE_MM - LABEL_MM)
    yield Text(Layer.FRAME, top, LABEL_MM, label)
    height = min(VALUE_MM, VALUE_MM * room / text_width(value, VALUE_MM))
    yield Text(Layer.FRAME, (left + INSIDE_MM, low + 2 * INSIDE_MM), height, value)


def notes(place: Point, width: float, lines: Sequence[str]) -> Iterator[Entity]:
    """Lines of notes below a place, their height such that all fit into a width (mm)."""
    widest = max(text_width(line, NOTE_MM) for line in lines)
    height = NOTE_MM * min(1.0, width / widest)
    for k, line in enumerate(lines, 1):
        yield Text(Layer.DIMENSIONS, (place[0], place[1] - k * LINE_MM), height, line)


def notes_beside_title(paper: Point, lines: Sequence[str]) -> Iterator[Entity]:
    """Lines of notes in the lower left corner, from the border to the title block."""
    left, low, right, _ = drawing_room(paper)
    return notes((left + BESIDE_MM, low), right - TITLE_MM[0] - left - 2 * BESIDE_MM, lines)


def placed(entities: Iterable[Entity], origin: Point, scale: float) -> list[Entity]:
    """Entities of a part on paper: scaled, with the part's origin at a place."""
    start = -origin[0] / scale, -origin[1] / scale
    return [moved(entity, start, scale) for entity in entities]


def moved(entity: Entity, start: Point, scale: float) -> Entity:
    """An entity from a start (mm) on, scaled."""

    def new(point: Point) -> Point:
        return (point[0] - start[0]) * scale, (point[1] - start[1]) * scale

    match entity:
        case Dimension(start=begin, end=end, line=line, drawn=drawn):
            parts = tuple(simple(moved(one, start, scale) for one in drawn))
            return replace(entity, start=new(begin), end=new(end), line=new(line), drawn=parts)
        case Line(_, begin, end):
            return replace(entity, start=new(begin), end=new(end))
        case Polyline(_, corners):
            return replace(entity, corners=tuple(map(new, corners)))
        case Circle(_, centre, radius) | Arc(_, centre, radius):
            return replace(entity, centre=new(centre), radius=radius * scale)
        case Text(_, place, height):
            return replace(entity, place=new(place), height=height * scale)


def table(
    corner: Point, widths: Sequence[float], rows: Sequence[tuple[str, ...]]
) -> Iterator[Entity]:
    """A table below and right of a corner, its head in the first row."""
    for k, cells in enumerate(rows):
        left, low = corner[0], corner[1] - (k + 1) * TABLE_ROW_MM
        for width, text in zip(widths, cells, strict=True):
            yield rectangle((left, low, left + width, low + TABLE_ROW_MM), Layer.DIMENSIONS)
            if text:
                place = left + CELL_MM, low + CELL_MM - 0.25
                yield Text(Layer.DIMENSIONS, place, _height(text, width), text)
            left += width


def is_legible(text: str, width: float) -> bool:
    """Whether a text is large enough in a cell of a width (mm)."""
    return not text or _height(text, width) >= LEAST_MM


def _height(text: str, width: float) -> float:
    """Height of a text such that it fits into a cell."""
    return TEXT_MM * min(1.0, (width - 2 * CELL_MM) / text_width(text, TEXT_MM))
