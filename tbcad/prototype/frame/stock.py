"""Stock that carries all parts: base plate, uprights, and the brackets of the uprights."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.cad.drafting.dimensions import across, arrow, centre_cross, labels
from tbcad.cad.drafting.sheet import (
    A3,
    A4,
    BESIDE_MM,
    TEXT_MM,
    Sheet,
    drawing_room,
    notes,
    placed,
    table,
)
from tbcad.cad.drafting.sheet import rectangle as outline
from tbcad.cad.formats.entities import Circle, Entity, Layer, Line, Point, Text
from tbcad.core.geometry.primitives import Component, box
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.files.bom import PartsList
from tbcad.prototype.frame.corner import CORNER, StandingBar
from tbcad.prototype.frame.shared import EXTRUSION_MM, UPRIGHTS, WASHER, BearingHead, drilled_holes
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.part import Bracket, FrameLayout, Mounted, Part, Site
from tbcad.prototype.purchased.parts import PurchasedPart, choose_part, choose_screw, of_kind
from tbcad.prototype.sheets import fitted, outer, title_block
from tbcad.types import Floats

M5_MM, TAPPED_M5_MM = 5.0, 4.2
PLATE_BORDER_MM = 10.0  # of the plate beyond the brackets' feet
HOLES = "plate_holes.csv"
PLATE, UPRIGHT = "drawing_plate", "drawing_upright"
TABLE_MM = (10.0, 18.0, 18.0, 14.0, 42.0)  # widths of the columns of the hole table
TABLE_HEAD = ("hole", "x", "y", "thread", "holds")
DATUM_MM, OFF_MM = 8.0, 4.0  # length of the arrows at the origin, and of lines beyond the part
SIDE_OR_NUMBER = re.compile(r"_(left|right|\d+)(?=_|$)")  # in names of bodies that are alike
LAMP_NOTES = {
    0: (),
    1: ("Left end on the plate. Marked: the screw of the lamps' holder, in the front slot.",),
    2: ("Left end on the plate. Marked: both screws of a lamp's holder, in the front slot.",),
}
LEVEL_MM = 8.0  # from one dimension line to the next
CUT_MM = 1.0  # tolerance of what is sawn, to either side: brackets clamp anywhere along


@dataclass(frozen=True, kw_only=True)
class Stock(Mounted):
    """Base plate and uprights."""

    plate: PurchasedPart  # part of the base plate
    corner: Floats  # the plate's, from where its holes are measured, (x, y) as the holes, mm, (2,)
    holes: Floats  # its tapped M5 holes, (x, y) along the frame's axes, mm, (h, 2)
    holds: tuple[str, ...]  # bracket that each hole holds
    upright: PurchasedPart  # part that the uprights are cut from
    length: float  # of the uprights, mm
    floor: float  # height (z) of the plate's upper face, which the uprights stand on, mm


def stock_layout(site: Site, before: FrameLayout) -> Stock:
    """The plate under all feet, and the uprights; SpecError where none on sale is large enough."""
    upright, length, bars = _uprights(site, before.of(BearingHead))
    plate, body, corner = _plate(site, before.brackets)
    return Stock(
        purchased=(body, *(bar.component for bar in bars)),
        fasteners=tuple(_plate_fasteners(site, before.brackets)),
        listed={plate.name: 1, upright.name: len(UPRIGHTS)},
        plate=plate,
        corner=corner,
        holes=np.vstack([bracket.holes for bracket in before.brackets]),
        holds=tuple(one.component.name for one in before.brackets for _ in one.holes),
        upright=upright,
        length=length,
        floor=before.of(BearingHead).top - length,
    )


def feet_layout(site: Site, before: FrameLayout) -> Mounted:
    """Corner brackets on the fronts and the backs of both uprights."""
    _, _, bars = _uprights(site, before.of(BearingHead))
    brackets = [one for bar in bars for one in bar.brackets(((1, 0), (-1, 0)))]
    return Mounted(brackets=tuple(brackets), listed={CORNER: len(brackets)})


def _uprights(site: Site, head: BearingHead) -> tuple[PurchasedPart, float, list[StandingBar]]:
    """Part and length of the uprights, and both of them."""
    spec = site.spec.prototype.frame
    length, x = head.top - spec.floor_mm, head.face - EXTRUSION_MM / 2
    hint = "make prototype.frame.floor_mm greater, or add a longer one"
    part = choose_part(site.parts, "extrusions", "prototype.frame.floor_mm", hint, length_mm=length)
    ends, across = (spec.floor_mm, head.top), spec.uprights_mm / 2
    middles = (np.array([x, side * across]) for side in (1, -1))
    bars = zip(UPRIGHTS, middles, strict=True)
    return (
        part,
        length,
        [StandingBar(name, part, middle, ends, site.axes, site.parts) for name, middle in bars],
    )


def _plate(site: Site, brackets: Sequence[Bracket]) -> tuple[PurchasedPart, Component, Floats]:
    """The smallest plate under all feet, centred under them, with tapped holes; its corner."""
    floor, axes = site.spec.prototype.frame.floor_mm, site.axes
    feet = np.vstack([bracket.foot for bracket in brackets])
    low, high = feet.min(axis=0) - PLATE_BORDER_MM, feet.max(axis=0) + PLATE_BORDER_MM
    middle, (length, width) = (low + high) / 2, high - low
    candidates = [
        part
        for part in of_kind(site.parts, "plates")
        if part["length_mm"] >= length and part["width_mm"] >= width
    ]
    if not candidates:
        raise SpecError(
            f"no base plate in plates.csv is {length:.0f} x {width:.0f} mm: add one, or make "
            "prototype.camera_diameter_mm smaller"
        )
    part = min(candidates, key=lambda plate: plate["length_mm"] * plate["width_mm"])
    half = np.array([part["length_mm"], part["width_mm"]]) / 2
    bottom = floor - part["thickness_mm"]
    corners = (*(middle - half), bottom), (*(middle + half), floor)
    places = [np.array([*hole, bottom]) @ axes for bracket in brackets for hole in bracket.holes]
    holes = drilled_holes(places, part["thickness_mm"] * axes[2], TAPPED_M5_MM)
    body = Component("plate", part.what, (box(*corners, axes),), tuple(holes), part=part.name)
    return part, body, middle - half


def _plate_fasteners(site: Site, brackets: Sequence[Bracket]) -> Iterator[Fastener]:
    """Screws with washers through brackets into threads of the base plate, by their diameter."""
    spec, axes = site.spec.prototype.frame, site.axes
    washer, down = site.parts[WASHER], -axes[2]
    for bracket in brackets:
        thick = bracket.thickness or spec.flange_mm
        screw = choose_screw(site.parts, M5_MM, washer["thickness_mm"] + thick + M5_MM)
        through = (bracket.component.name, "plate")
        for x, y in bracket.holes.tolist():
            place = np.array([x, y, spec.floor_mm + thick]) @ axes
            yield Fastener(washer, place, down, through[:1])
            yield Fastener(screw, place - washer["thickness_mm"] * down, down, through)


@planned("Drill the plate, cut the uprights", "plate")
def shop_step(machine: AssembledMachine) -> Values:
    """Plate and uprights as drawn; what must be matt black is blackened before it is mounted."""
    stock = machine.record.frame_stock
    plate, upright = map(machine.record.drawing_of, (stock.plate, stock.upright))
    finished = (one.name for one in machine.record.bought if one.finish and one.part)
    kinds = dict.fromkeys(SIDE_OR_NUMBER.sub("", name).replace("_", " ") for name in finished)
    black = ", ".join(kinds)
    return {
        "stock": stock,
        "plate": machine.ref(stock.plate),
        "plate_drawing": plate or HOLES,
        "upright": machine.ref(stock.upright),
        "upright_drawing": when(upright, f" ({upright})"),
        "black": black,
        "holes": HOLES,
    }


@planned("Uprights on the plate", "upright_*")
def frame_step(machine: AssembledMachine) -> Values:
    """Brackets and uprights; T-nuts in the front slot of each and in its back one."""
    axis = np.array(machine.record.frame.axis)
    some = [one for one in machine.fasteners if machine.kind(one.part) == "tnuts"]
    nuts = [one.along @ axis for one in some if one.through[-1] in UPRIGHTS]
    # Screws go in from the front against the axis, which leans from the uprights to the camera.
    front = sum(along < 0 for along in nuts)
    back = len(nuts) - front
    return {"front": front // len(UPRIGHTS), "back": back // len(UPRIGHTS)}


def plate_sheet(stock: Stock, bill: PartsList) -> Sheet:
    """The plate from above with its tapped holes, and their table; the origin is its corner."""
    part, paper = stock.plate, A3
    size = part["length_mm"], part["width_mm"]
    left, low, right, high = drawing_room(paper)
    left_of_table = right - sum(TABLE_MM)
    scale, origin = fitted(size, (left, low, left_of_table - BESIDE_MM, high))
    holes = [
        Circle(Layer.CUT, (x, y), TAPPED_M5_MM / 2)
        for x, y in (stock.holes - stock.corner).tolist()
    ]
    part_drawn = placed([outline((0, 0, *size), Layer.CUT), *holes], origin, scale)
    circles = [entity for entity in part_drawn if isinstance(entity, Circle)]
    numbers = [str(number) for number in range(1, len(holes) + 1)]
    text = (
        f"Plate {size[0]:g} x {size[1]:g} x {part['thickness_mm']:g}, bought to this size.",
        f"{len(holes)} x M5: drill {TAPPED_M5_MM:g} through, tap through.",
        "x runs from the uprights to the camera, both axes from the corner at the arrows.",
        "Seen from the side that carries the brackets. Deburr all edges.",
    )
    block = title_block(bill, "base plate", part, "from above")
    entities = [
        *part_drawn,
        *(line for circle in circles for line in centre_cross(circle)),
        *labels(circles, numbers),
        *outer(origin, (size[0] * scale, size[1] * scale), size),
        *_datum(origin),
        *table((left_of_table, high), TABLE_MM, (TABLE_HEAD, *_hole_cells(stock))),
    ]
    return Sheet.framed((PLATE, part.name), block, paper, scale, origin, entities, text)


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


def _hole_cells(stock: Stock) -> list[tuple[str, ...]]:
    places = (stock.holes - stock.corner).tolist()
    return [
        (str(number), f"{x:.2f}", f"{y:.2f}", "M5", name.replace("_", " "))
        for number, ((x, y), name) in enumerate(zip(places, stock.holds, strict=True), 1)
    ]


def upright_sheet(stock: Stock, screws: Sequence[float], bill: PartsList) -> Sheet:
    """An upright, lying: its length, and heights (z) of a lamp holder's screws, if any.

    The origin is its lower left corner.
    """
    part, paper, length = stock.upright, A4, stock.length
    left, low, right, high = drawing_room(paper)
    side, slot = part["side_mm"], part["slot_mm"]
    middle = low + (high - low) / 2
    scale, origin = fitted((length, side), (left, middle, right, high))
    lines = [
        Line(Layer.CUT, (0.0, side / 2 + sign * slot / 2), (length, side / 2 + sign * slot / 2))
        for sign in (-1, 1)
    ]
    drawn = placed([outline((0, 0, length, side), Layer.CUT), *lines], origin, scale)
    centre = origin[1] + side * scale / 2
    heights = sorted(z - stock.floor for z in screws)
    text = (
        f"Saw from {part.what}.",
        f"Length {length:.1f} ± {CUT_MM:g}, both of the same length to 0.2; ends square to 0.2.",
        "No holes: head and brackets are held by T-nuts in the slots. Deburr both ends.",
        *LAMP_NOTES[len(heights)],
    )
    entities = [
        *drawn,
        Line(Layer.CENTRE, (origin[0] - 4, centre), (origin[0] + length * scale + 4, centre)),
        *outer(origin, (length * scale, side * scale), (round(length, 1), side)),
        *_heights(origin, side, heights, scale),
        *notes((left + BESIDE_MM, middle), right - left - 2 * BESIDE_MM, text),
    ]
    block = title_block(bill, "upright", part, "from the side")
    return Sheet.framed((UPRIGHT, part.name), block, paper, scale, origin, entities)


def _heights(
    origin: Point, side: float, heights: Sequence[float], scale: float
) -> Iterator[Entity]:
    """Screws on a lying upright, each with its distance from the left end."""
    (x, low), high = origin, origin[1] + side * scale
    for level, height in enumerate(heights, 1):
        at = x + height * scale
        yield Line(Layer.CENTRE, (at, low - OFF_MM), (at, high + OFF_MM))
        yield across((x, high), (at, high), high + level * LEVEL_MM, f"{height:.1f}")


def _sheets(_: Site, frame: FrameLayout, bill: PartsList) -> tuple[Sheet, ...]:
    stock, lamps = frame.of(Stock), frame.find(LampLayout)
    return plate_sheet(stock, bill), upright_sheet(stock, lamps.screws if lamps else (), bill)


STOCK = Part((shop_step,), stock_layout, _sheets, {"plate": "prototype.frame.floor_mm less"})
FEET = Part((frame_step,), feet_layout)
