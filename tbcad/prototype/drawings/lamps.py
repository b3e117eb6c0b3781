"""The sheet of the lamps: how strips are cut, and where they stick on their plates."""

from collections.abc import Iterator

from tbcad.cad.drafting.dimensions import upward
from tbcad.cad.drafting.sheet import (
    A4,
    BESIDE_MM,
    Sheet,
    drawing_room,
    notes,
    placed,
    rectangle,
    sheet_frame,
)
from tbcad.cad.formats.entities import Entity, Layer, Line
from tbcad.prototype.drawings.parts import Listed, fitted, outer
from tbcad.prototype.frame.purchased import EXTRUSION_MM
from tbcad.prototype.light.lamp import EDGE_MM, LampLayout

LAMP = "drawing_lamp"
CUT_MM = 0.5  # tolerance of a cut at its mark, to either side
BESIDE_STRIPS_MM = 8.0  # of dimension lines from the strips


def lamp_sheet(lamps: LampLayout, bill: Listed) -> Sheet:
    """The strips of a lamp side by side, lying; the origin is their lower left corner."""
    part, paper = lamps.strip, A4
    left, low, right, high = drawing_room(paper)
    middle = low + (high - low) / 2
    size, pieces = (lamps.length, lamps.width), lamps.strips * len(lamps.places)
    scale, origin = fitted(size, (left, middle, right, high))
    wide = part["width_mm"]
    strips = [
        rectangle((0.0, k * wide, lamps.length, (k + 1) * wide), Layer.CUT)
        for k in range(lamps.strips)
    ]
    drawn = placed([*strips, *_marks(lamps)], origin, scale)
    title = "strips of a lamp"
    text = (
        f"Cut {pieces} pieces of {lamps.length:g} \u00b1 {CUT_MM:g}, {lamps.strips} for each of "
        f"{len(lamps.places)} lamps, at marks every {part['cut_mm']:g}, through the copper pads.",
        _place_note(lamps),
        "Solder a cable to the pads of one end, plus to plus, before sticking; insulate the pads.",
        f"{part['supply_v']:g} V, {part['watt_m'] * lamps.length / part['supply_v']:.0f} "
        "mA for each piece; all pieces in parallel.",
    )
    entities = [
        *sheet_frame(paper, scale, bill.block(title, part, "on the shining face")),
        *drawn,
        *outer(origin, (size[0] * scale, size[1] * scale), size),
        *_one_strip(lamps, origin, scale),
        *notes((left + BESIDE_MM, middle), right - left - 2 * BESIDE_MM, text),
    ]
    return Sheet(LAMP, title, part.name, paper, scale, origin, tuple(entities))


def _marks(lamps: LampLayout) -> Iterator[Entity]:
    """Marks between the ends that are not cut."""
    step = lamps.strip["cut_mm"]
    for k in range(1, round(lamps.length / step)):
        yield Line(Layer.CENTRE, (k * step, 0.0), (k * step, lamps.width))


def _one_strip(lamps: LampLayout, origin: tuple[float, float], scale: float) -> Iterator[Entity]:
    """Width of a strip, on the right, where a lamp has more than one."""
    if lamps.strips == 1:
        return
    x, y = origin[0] + lamps.length * scale, origin[1]
    end = y + lamps.strip["width_mm"] * scale
    yield upward((x, y), (x, end), x + BESIDE_STRIPS_MM, f"{lamps.strip['width_mm']:g}")


def _place_note(lamps: LampLayout) -> str:
    """Where the strips stick on the printed plates."""
    if not lamps.level:
        half = max(lamps.width / 2 + EDGE_MM, EXTRUSION_MM / 2)
        return (
            f"Stick them upright on the printed face, side by side, {EDGE_MM:g} below its upper "
            f"end: in the middle of a stand, their middle {half:g} from the outer edge of a holder."
        )
    aside = abs(float(lamps.places[0, 1]))
    middle = (
        f"their middle {aside:g} beside the middle of bar and bridge, on opposite sides"
        if aside
        else "in the middle of bar and bridge"
    )
    return (
        f"Stick them level on the printed face, one above the other, at half its height, {middle}."
    )
