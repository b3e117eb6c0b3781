"""Extrusions that stand on the base plate, held by bought corner brackets.

A bracket has two legs with a slot in each, and a side at either end of them. Its body is simplified
as the list has it: no fillets, and slots that go straight through.
"""

from collections.abc import Sequence

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, Prism, box, slot
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.shared import (
    CLEARANCE_HOLE_MM,
    ENGAGEMENT_MM,
    EXTRUSION_MM,
    THROUGH_MM,
    TNUT,
    WASHER,
)
from tbcad.prototype.part import Bracket, Site
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_screw
from tbcad.types import Floats

CORNER = "BRACKET-2028"
SLOT_DEPTH_MM = 6.1  # of an extrusion of 20 mm; no list gives it


def standing_bar(
    name: str, part: PurchasedPart, middle: Floats, ends: tuple[float, float], axes: Floats
) -> Component:
    """An extrusion about an upright line (2,) of the frame's axes, between two heights, mm."""
    half, (low, high) = EXTRUSION_MM / 2, ends
    body = box((*(middle - half), low), (*(middle + half), high), axes)
    slots = _slots(part["slot_mm"], middle, ends, axes)
    what = f"{part.what}, cut to {high - low:.1f} mm"
    return Component(name, what, (body,), slots, part=part.name)


def _slots(
    width: float, middle: Floats, ends: tuple[float, float], axes: Floats
) -> tuple[Primitive, ...]:
    """The four slots of an extrusion, simplified: as wide inside as at its face."""
    half, inner, outer = width / 2, EXTRUSION_MM / 2 - SLOT_DEPTH_MM, EXTRUSION_MM / 2 + THROUGH_MM
    low, high = (np.array([*middle, z]) for z in (ends[0] - THROUGH_MM, ends[1] + THROUGH_MM))
    spans = ((inner, outer), (-outer, -inner))
    sides = [((a, -half, 0.0), (b, half, 0.0)) for a, b in spans]
    sides += [((-half, a, 0.0), (half, b, 0.0)) for a, b in spans]
    return tuple(box(low + one, high + other, axes) for one, other in sides)


def corner_brackets(
    site: Site, name: str, bar: str, middle: Floats, sides: Sequence[tuple[int, int]]
) -> tuple[Bracket, ...]:
    """Brackets named from 1 on some sides of a bar on the plate, whose middle (2,) is given, mm.

    Sides are unit vectors along the frame's level axes.
    """
    return tuple(
        _corner_bracket(site, f"{name}_{number}", bar, middle, np.array([*side, 0.0]))
        for number, side in enumerate(sides, 1)
    )


def _corner_bracket(site: Site, name: str, bar: str, middle: Floats, out: Floats) -> Bracket:
    parts, part, up = site.parts, site.parts[CORNER], np.array([0.0, 0.0, 1.0])
    own = np.stack([out, np.cross(up, out), up])  # out from the bar, across, up
    start = np.array([*middle, site.spec.prototype.frame.floor_mm]) + EXTRUSION_MM / 2 * out
    axes = own @ site.axes
    at = start @ site.axes
    leg, half, base = part["leg_mm"], part["width_mm"] / 2, part["base_mm"]
    component = Component(
        name, part.what, (_body(part, axes, at),), _removed(part, axes, at), part=part.name
    )
    ends = np.array([[a, b, 0.0] for a in (0.0, leg) for b in (-half, half)]) @ own + start
    hole = start + part["hole_mm"] * out
    on_bar = at + np.array([base, 0.0, part["hole_mm"]]) @ axes
    return Bracket(
        component,
        hole[None, :2],
        ends[:, :2],
        _on_bar((name, bar), on_bar, -axes[0], base, parts),
        thickness=base,
    )


def _prism(section: Floats, half: float, axes: Floats, at: Floats) -> Prism:
    """A convex polygon (n, 2), out from the bar and up, across it to either side."""
    out, up = section.T
    corners = np.column_stack([out, np.full(len(out), -half), up])
    return Prism(at + corners @ axes, 2 * half * axes[1])


def _body(part: PurchasedPart, axes: Floats, at: Floats) -> Prism:
    leg, base = part["leg_mm"], part["base_mm"]
    section = np.array([[0.0, 0.0], [leg, 0.0], [leg, base], [base, leg], [0.0, leg]])
    return _prism(section, part["width_mm"] / 2, axes, at)


def _removed(part: PurchasedPart, axes: Floats, at: Floats) -> tuple[Primitive, ...]:
    """The room between both sides, and a slot in each leg."""
    leg, base, hole = part["leg_mm"], part["base_mm"], part["hole_mm"]
    beyond, inside = leg + base, part["width_mm"] / 2 - part["side_mm"]
    room = np.array([[base, base], [beyond, base], [base, beyond]])
    radius = CLEARANCE_HOLE_MM[5.0] / 2
    travel, deep = part["slot_mm"] - 2 * radius, base + 2 * THROUGH_MM
    slots = (
        slot(at + first @ axes, along, travel, radius, deep * depth)
        for first, along, depth in (
            (np.array([hole, 0.0, -THROUGH_MM]), axes[0], axes[2]),
            (np.array([-THROUGH_MM, 0.0, hole]), axes[2], axes[0]),
        )
    )
    return (_prism(room, inside, axes, at), *slots)


def _on_bar(
    through: tuple[str, str], place: Floats, inward: Floats, thickness: float, parts: Parts
) -> tuple[Fastener, ...]:
    """Washer, screw and T-nut; the place (3,) is on the leg's inner face."""
    washer, name = parts[WASHER], through[:1]
    thick = washer["thickness_mm"]
    screw = choose_screw(parts, 5.0, thick + thickness + ENGAGEMENT_MM)
    return (
        Fastener(washer, place, inward, name),
        Fastener(screw, place - thick * inward, inward, through),
        Fastener(parts[TNUT], place + thickness * inward, inward, through[1:]),
    )
