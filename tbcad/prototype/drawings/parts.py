"""The sheets: base plate, driven wheel, uprights."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.cad.drafting.dimensions import (
    across,
    arrow,
    centre_cross,
    diameter,
    labels,
    upward,
)
from tbcad.cad.drafting.sheet import (
    A3,
    A4,
    BESIDE_MM,
    TEXT_MM,
    Sheet,
    TitleBlock,
    choose_scale,
    drawing_room,
    notes,
    notes_beside_title,
    placed,
    rectangle,
    sheet_frame,
    table,
)
from tbcad.cad.formats.checked_files import Row
from tbcad.cad.formats.entities import Circle, Entity, Layer, Line, Point, Text
from tbcad.prototype.base.hub import PATTERNS, SCREW_MM
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.frame.head import GAP_MM
from tbcad.prototype.frame.layout import FrameLayout
from tbcad.prototype.frame.purchased import EXTRUSION_MM, TAPPED_M5_MM, wheel_radius
from tbcad.prototype.light.lamp import EDGE_MM, LampLayout
from tbcad.prototype.purchased.parts import PurchasedPart

PLATE, WHEEL, UPRIGHT = "drawing_plate", "drawing_wheel", "drawing_upright"
TABLE_MM = (10.0, 18.0, 18.0, 14.0, 42.0)  # widths of the columns of the hole table
TABLE_HEAD = ("hole", "x", "y", "thread", "holds")
ASIDE_MM = 14.0  # of dimension lines from the part
BEFORE_MM, BEHIND_MM = 22.0, 10.0  # room for dimensions left and below, and on the other sides
NOTES_MM = 85.0  # width of the notes' column on A4
DATUM_MM, OFF_MM = 8.0, 4.0  # length of the arrows at the origin, and their distance from it
LAMP_NOTES = {
    0: (),
    1: ("Left end on the plate. Marked: the screw of the lamps' holder, in the front slot.",),
    2: ("Left end on the plate. Marked: both screws of a lamp's holder, in the front slot.",),
}
LEVEL_MM = 8.0  # from one dimension line to the next
CUT_MM = 1.0  # tolerance of what is sawn, to either side: feet clamp anywhere along
LAMP = "drawing_lamp"
STRIP_CUT_MM = 0.5  # tolerance of a cut at its mark, to either side
BESIDE_STRIPS_MM = 8.0  # of dimension lines from the strips


@dataclass(frozen=True)
class Listed:
    """What all sheets take from the parts list."""

    design: str  # name of it
    items: Mapping[str, int]  # number of each part
    quantities: Mapping[str, int]  # of each part

    def block(self, title: str, part: PurchasedPart, view: str) -> TitleBlock:
        """The title block of a part's drawing."""
        item = f"{self.items[part.name]}: {part.name}"
        return TitleBlock(title, self.design, item, self.quantities[part.name], part.material, view)


def listed(design: str, rows: Sequence[Row]) -> Listed:
    """From the rows of the parts list."""
    items = {str(row["part"]): int(row["item"] or 0) for row in rows}
    return Listed(design, items, {str(row["part"]): int(row["quantity"] or 0) for row in rows})


def sheets(frame: FrameLayout, base: BaseLayout, drive: Drive, bill: Listed) -> list[Sheet]:
    """All sheets of a prototype."""
    wheel = [wheel_sheet(base, drive.wheel, bill)] if drive.wheel else []
    lamps = [lamp_sheet(frame.lamps, bill)] if frame.lamps else []
    return [plate_sheet(frame, bill), upright_sheet(frame, bill), *wheel, *lamps]


def plate_sheet(frame: FrameLayout, bill: Listed) -> Sheet:
    """The plate from above with its tapped holes, and their table; the origin is its corner."""
    part, paper = frame.plate, A3
    size = part["length_mm"], part["width_mm"]
    left, low, right, high = drawing_room(paper)
    left_of_table = right - sum(TABLE_MM)
    scale, origin = fitted(size, (left, low, left_of_table - BESIDE_MM, high))
    holes = [
        Circle(Layer.CUT, (x, y), TAPPED_M5_MM / 2)
        for x, y in (frame.holes - frame.corner).tolist()
    ]
    part_drawn = placed([rectangle((0, 0, *size), Layer.CUT), *holes], origin, scale)
    circles = [entity for entity in part_drawn if isinstance(entity, Circle)]
    numbers = [str(number) for number in range(1, len(holes) + 1)]
    title = "base plate"
    text = (
        f"Plate {size[0]:g} x {size[1]:g} x {part['thickness_mm']:g}, bought to this size.",
        f"{len(holes)} x M5: drill {TAPPED_M5_MM:g} through, tap through.",
        "x runs from the uprights to the camera, both axes from the corner at the arrows.",
        "Seen from the side that carries the brackets. Deburr all edges.",
    )
    entities = [
        *sheet_frame(paper, scale, bill.block(title, part, "from above")),
        *part_drawn,
        *(line for circle in circles for line in centre_cross(circle)),
        *labels(circles, numbers),
        *outer(origin, (size[0] * scale, size[1] * scale), size),
        *_datum(origin),
        *table((left_of_table, high), TABLE_MM, (TABLE_HEAD, *_hole_cells(frame))),
        *notes_beside_title(paper, text),
    ]
    return Sheet(PLATE, title, part.name, paper, scale, origin, tuple(entities))


def wheel_sheet(base: BaseLayout, part: PurchasedPart, bill: Listed) -> Sheet:
    """The driven wheel from behind the hub, x toward azimuth zero; the origin is its middle."""
    paper, radius = A4, wheel_radius(part)
    left, low, right, high = drawing_room(paper)
    circle = PATTERNS[base.spec.drive].circle
    corner = right - NOTES_MM, high
    scale, origin = fitted(
        (2 * radius, 2 * radius), (left, low, corner[0] - BESIDE_MM, high), (radius, radius)
    )
    places: list[Point] = [(float(x), float(y)) for x, y in base.hub.holes]
    holes = [Circle(Layer.CUT, place, SCREW_MM / 2) for place in places]
    outline = [Circle(Layer.CUT, (0, 0), radius), Circle(Layer.CUT, (0, 0), part["bore_mm"] / 2)]
    on_circle = Circle(Layer.CENTRE, (0, 0), circle / 2)
    drawn = placed([*outline, *holes, on_circle], origin, scale)
    circles = [one for one in drawn if isinstance(one, Circle) and one.layer == Layer.CUT]
    title = "driven wheel"
    angle = float(np.degrees(np.arctan2(places[0][1], places[0][0])))
    on_holes = f"{len(holes)} x Ø<> on Ø{circle:g}"
    text = (
        f"{part['teeth']:g} teeth, pitch {part['pitch_mm']:g}, width of the belt's rim as bought.",
        f"{len(holes)} x Ø{SCREW_MM:g} through on a circle of Ø{circle:g} ± 0.1,",
        f"the first at {angle:.0f}°, the others {360 / len(holes):g}° apart.",
        "Drill from the flat side that lies against the",
        "zero disc; the bore stays as bought.",
        "In brackets: over the rims, as bought.",
        f"Turn off a hub: the head's plate is {GAP_MM:g} mm behind.",
    )
    ring, bore, first = circles[0], circles[1], circles[2]
    right, top = origin[0] + ring.radius, ring.centre[1] + ring.radius
    entities = [
        *sheet_frame(paper, scale, bill.block(title, part, "on the face at the zero disc")),
        *drawn,
        *(line for one in (ring, *circles[2:]) for line in centre_cross(one)),
        across(
            (origin[0] - ring.radius, origin[1]),
            (right, origin[1]),
            origin[1] - ring.radius - ASIDE_MM / 2,
            f"{2 * radius:.1f}",
            "(Ø<>)",
        ),
        diameter(first, *_called(first, (right, top)), f"{SCREW_MM:g}", on_holes),
        diameter(bore, *_called(bore, (right, origin[1])), f"{part['bore_mm']:g}", "Ø<>"),
        *notes(corner, NOTES_MM - BESIDE_MM, text),
    ]
    return Sheet(WHEEL, title, part.name, paper, scale, origin, tuple(entities))


def upright_sheet(frame: FrameLayout, bill: Listed) -> Sheet:
    """An upright, lying: its length; the origin is its lower left corner."""
    part, paper, length = frame.upright, A4, frame.length
    left, low, right, high = drawing_room(paper)
    side, slot = part["side_mm"], part["slot_mm"]
    middle = low + (high - low) / 2
    scale, origin = fitted((length, side), (left, middle, right, high))
    lines = [
        Line(Layer.CUT, (0.0, side / 2 + sign * slot / 2), (length, side / 2 + sign * slot / 2))
        for sign in (-1, 1)
    ]
    drawn = placed([rectangle((0, 0, length, side), Layer.CUT), *lines], origin, scale)
    centre = origin[1] + side * scale / 2
    # Of a lamp holder's screws above the plate, mm; none without lamps.
    heights = sorted(z - frame.floor for z in frame.lamps.screws) if frame.lamps else []
    title = "upright"
    text = (
        f"Saw from {part.what}.",
        f"Length {length:.1f} ± {CUT_MM:g}, both of the same length to 0.2; ends square to 0.2.",
        "No holes: head and feet are held by T-nuts in the slots. Deburr both ends.",
        *LAMP_NOTES[len(heights)],
    )
    entities = [
        *sheet_frame(paper, scale, bill.block(title, part, "from the side")),
        *drawn,
        Line(Layer.CENTRE, (origin[0] - 4, centre), (origin[0] + length * scale + 4, centre)),
        *outer(origin, (length * scale, side * scale), (round(length, 1), side)),
        *_heights(origin, side, heights, scale),
        *notes((left + BESIDE_MM, middle), right - left - 2 * BESIDE_MM, text),
    ]
    return Sheet(UPRIGHT, title, part.name, paper, scale, origin, tuple(entities))


def _heights(
    origin: Point, side: float, heights: Sequence[float], scale: float
) -> Iterator[Entity]:
    """Screws on a lying upright, each with its distance from the left end."""
    (x, low), high = origin, origin[1] + side * scale
    for level, height in enumerate(heights, 1):
        at = x + height * scale
        yield Line(Layer.CENTRE, (at, low - OFF_MM), (at, high + OFF_MM))
        yield across((x, high), (at, high), high + level * LEVEL_MM, f"{height:.1f}")


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


def _datum(origin: Point) -> Iterator[Entity]:
    """Arrows along x and y at the origin, outside the part."""
    x, y = origin
    corner = x - OFF_MM, y - OFF_MM
    right, up = (x + DATUM_MM, corner[1]), (corner[0], y + DATUM_MM)
    beyond_x, beyond_y = (right[0] + 1.0, right[1] - 1.0), (up[0] - 0.6, up[1] + 1.0)
    for tip, place, name in ((right, beyond_x, "x"), (up, beyond_y, "y")):
        yield Line(Layer.DIMENSIONS, corner, tip)
        yield arrow(tip, corner)
        yield Text(Layer.DIMENSIONS, place, TEXT_MM, name)


def _called(circle: Circle, corner: Point) -> tuple[Point, Point]:
    """Both ends of a leader: on a circle, and beside a place."""
    place = corner[0] + BESIDE_MM, corner[1] + BESIDE_MM
    x, y = place[0] - circle.centre[0], place[1] - circle.centre[1]
    share = circle.radius / float(np.hypot(x, y))
    tip = circle.centre[0] + share * x, circle.centre[1] + share * y
    return tip, place


def _hole_cells(frame: FrameLayout) -> list[tuple[str, ...]]:
    places = (frame.holes - frame.corner).tolist()
    return [
        (str(number), f"{x:.2f}", f"{y:.2f}", "M5", name.replace("_", " "))
        for number, ((x, y), name) in enumerate(zip(places, frame.holds, strict=True), 1)
    ]


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
    steps = part["cut_mm"] * np.arange(1, round(lamps.length / part["cut_mm"]))
    uncut = [Line(Layer.CENTRE, (x, 0.0), (x, lamps.width)) for x in steps.tolist()]
    drawn = placed([*strips, *uncut], origin, scale)
    x, y = origin[0] + lamps.length * scale, origin[1]  # beside it, the width of a strip
    of_one = upward((x, y), (x, y + wide * scale), x + BESIDE_STRIPS_MM, f"{wide:g}")
    title = "strips of a lamp"
    text = (
        f"Cut {pieces} pieces of {lamps.length:g} \u00b1 {STRIP_CUT_MM:g}, {lamps.strips} for each "
        f"of {len(lamps.places)} lamps, at marks every {part['cut_mm']:g}, through the copper "
        "pads.",
        _place_note(lamps),
        "Solder a cable to the pads of one end, plus to plus, before sticking; insulate the pads.",
        f"{part['supply_v']:g} V, {part['watt_m'] * lamps.length / part['supply_v']:.0f} "
        "mA for each piece; all pieces in parallel.",
    )
    entities = [
        *sheet_frame(paper, scale, bill.block(title, part, "on the shining face")),
        *drawn,
        *outer(origin, (size[0] * scale, size[1] * scale), size),
        *([of_one] if lamps.strips > 1 else []),
        *notes((left + BESIDE_MM, middle), right - left - 2 * BESIDE_MM, text),
    ]
    return Sheet(LAMP, title, part.name, paper, scale, origin, tuple(entities))


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
