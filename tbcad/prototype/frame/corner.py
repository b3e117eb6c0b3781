"""Extrusions that stand on the base plate, held by bought corner brackets.

A bracket has two legs with a slot in each, and a side at either end of them. Its body is simplified
as the list has it: no fillets, and slots that go straight through.
"""

from collections.abc import Sequence
from dataclasses import dataclass

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
from tbcad.prototype.part import Bracket
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_screw
from tbcad.types import Floats

CORNER = "BRACKET-2028"
SLOT_DEPTH_MM = 6.1  # of an extrusion of 20 mm; no list gives it


@dataclass(frozen=True)
class StandingBar:
    """An extrusion that stands on the plate."""

    name: str  # of its body
    part: PurchasedPart  # that it is cut from
    middle: Floats  # of its section, along the frame's level axes, mm, (2,)
    ends: tuple[float, float]  # heights of both ends, mm
    axes: Floats  # of the frame, as rows, (3, 3)
    parts: Parts  # lists of purchased parts

    @property
    def component(self) -> Component:
        """Its body."""
        half, (low, high) = EXTRUSION_MM / 2, self.ends
        body = box((*(self.middle - half), low), (*(self.middle + half), high), self.axes)
        slots = _slots(self.part["slot_mm"], self.middle, self.ends, self.axes)
        what = f"{self.part.what}, cut to {high - low:.1f} mm"
        return Component(self.name, what, (body,), slots, part=self.part.name)

    def brackets(self, sides: Sequence[tuple[int, int]]) -> tuple[Bracket, ...]:
        """Corner brackets on some of its sides, unit vectors along the frame's level axes."""
        outward = [np.array([*side, 0.0]) for side in sides]
        return tuple(_corner_bracket(self, k, out) for k, out in enumerate(outward, 1))


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


def _corner_bracket(bar: StandingBar, number: int, out: Floats) -> Bracket:
    parts, part, up = bar.parts, bar.parts[CORNER], np.array([0.0, 0.0, 1.0])
    own = np.stack([out, np.cross(up, out), up])  # out from the bar, across, up
    start = np.array([*bar.middle, bar.ends[0]]) + EXTRUSION_MM / 2 * out
    at, axes, name = start @ bar.axes, own @ bar.axes, f"{bar.name}_bracket_{number}"
    leg, half, base = part["leg_mm"], part["width_mm"] / 2, part["base_mm"]
    body, removed = _body(part, axes, at), _removed(part, axes, at)
    ends = np.array([[a, b, 0.0] for a in (0.0, leg) for b in (-half, half)]) @ own + start
    hole = start + part["hole_mm"] * out
    on_bar = at + np.array([base, 0.0, part["hole_mm"]]) @ axes
    return Bracket(
        Component(name, part.what, (body,), removed, part=part.name),
        hole[None, :2],
        ends[:, :2],
        _on_bar((name, bar.name), on_bar, -axes[0], base, parts),
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
