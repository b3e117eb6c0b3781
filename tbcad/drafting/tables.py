"""Tables on paper; all lengths in mm."""

from collections.abc import Iterator, Sequence

from tbcad.drafting.sheet import rectangle
from tbcad.formats.entities import Entity, Layer, Point, Text
from tbcad.formats.pdf import text_width

ROW_MM, TEXT_MM, CELL_MM = 5.0, 2.5, 1.5  # height of rows and texts, room before a text
LEAST_MM = 1.6  # height of a text that is read without a lens


def table(
    corner: Point, widths: Sequence[float], rows: Sequence[tuple[str, ...]]
) -> Iterator[Entity]:
    """A table below and right of a corner, its head in the first row."""
    for k, cells in enumerate(rows):
        left, low = corner[0], corner[1] - (k + 1) * ROW_MM
        for width, text in zip(widths, cells, strict=True):
            yield rectangle((left, low, left + width, low + ROW_MM), Layer.DIMENSIONS)
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
