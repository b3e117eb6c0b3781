"""Shared by sheets of parts: title block, scale, outer dimensions."""

from collections.abc import Iterator

from tbcad.cad.drafting.dimensions import across, upward
from tbcad.cad.drafting.sheet import TitleBlock, choose_scale
from tbcad.cad.formats.entities import Entity, Point
from tbcad.prototype.files.bom import PartsList
from tbcad.prototype.purchased.parts import PurchasedPart

ASIDE_MM = 14.0  # of dimension lines from the part
BEFORE_MM, BEHIND_MM = 22.0, 10.0  # room for dimensions left and below, and on the other sides


def title_block(bill: PartsList, title: str, part: PurchasedPart, view: str) -> TitleBlock:
    """The title block of a part's drawing."""
    item, quantity = f"{bill.items[part.name]}: {part.name}", bill.quantities[part.name]
    return TitleBlock(title, bill.design, item, quantity, part.material, view)


def fitted(
    size: Point, room: tuple[float, float, float, float], datum: Point = (0.0, 0.0)
) -> tuple[float, Point]:
    """Scale of a part in the middle of a room with its dimensions, and where its datum is."""
    left, low, right, high = room
    left, low, right, high = left + BEFORE_MM, low + BEFORE_MM, right - BEHIND_MM, high - BEHIND_MM
    scale = choose_scale(size, (right - left, high - low))
    x = (left + right - size[0] * scale) / 2 + datum[0] * scale
    y = (low + high - size[1] * scale) / 2 + datum[1] * scale
    return scale, (x, y)


def outer(origin: Point, on_paper: Point, size: Point) -> Iterator[Entity]:
    """Length below, width on the left."""
    (x, y), (length, width) = origin, on_paper
    yield across((x, y), (x + length, y), y - ASIDE_MM, f"{size[0]:g}")
    yield upward((x, y), (x, y + width), x - ASIDE_MM, f"{size[1]:g}")
