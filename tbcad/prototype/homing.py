"""Sizes, mm, that zero disc, bearing head and bracket share; out: from the axis, azimuth zero."""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import (
    Component,
    Cylinder,
    Primitive,
    Prism,
    box,
    cylinder_between,
    rectangle,
)
from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.base.hub import KEY_HOLE_MM, KEY_MM, PIN_MM, PIN_OUT_MM, SCREW_MM, ZERO_DISC_MM
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.balance import HomeAngles, home_angles
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.shared import ENGAGEMENT_MM, THROUGH_MM, BearingHead, HeadPlate
from tbcad.prototype.part import FrameLayout, Mounted, Part, Site
from tbcad.prototype.purchased.parts import Parts, choose_part, choose_screw
from tbcad.types import Floats

PIN_HOLE_MM = 4.2
MARK_MM, MARK_DEPTH_MM = 1.0, 0.8  # width and depth of what is engraved
MARK_END_MM = 56.0  # out of the mark on the head's plate
BRACKET_MM = 14.0  # thickness, away from the side of the head's plate
BRACKET_LOW_MM, BRACKET_HIGH_MM = 46.0, 72.0  # out, of the bracket
BRACKET_EDGE_MM = 4.0  # from the bracket's ends to its screws
MIN_PLATE_MM = BRACKET_HIGH_MM + 2.0  # out, of the plate's end
# Of the switch's roller from the line of its holes: when free, and when the switch trips.
FREE_MM, TRIP_MM = 19.3, 14.5
TAB_BEYOND_MM = 0.7  # of the tab beyond where the switch trips
SWITCH = "SWITCH-ROLLER"
# Of the switch, from the line of its holes: toward the axis to its body's end, outward to the
# other, half its length; to the roller when fully pressed.
BODY_IN_MM, BODY_OUT_MM, BODY_HALF_MM = 7.3, 2.9, 9.9
PRESSED_MM = 13.2
SWITCH_MM, SWITCH_HOLES_MM, SWITCH_HOLE_MM = 6.4, 9.5, 2.35  # thickness, distance, diameter
HOLES_MM = -SWITCH_HOLES_MM / 2, SWITCH_HOLES_MM / 2  # around, from the middle of the switch
ROLLER_MM, ROLLER_LENGTH_MM = 4.8, 3.4
LEVER_FROM_MM, LEVER_TO_MM, LEVER_HALF_MM = 9.0, 7.0, 6.0
# Hole that an M2 screw cuts its thread in: it comes out 0.1 to 0.3 mm narrower, and FDM prints no
# hole of less than 2 mm.
PILOT_MM, PILOT_DEPTH_MM = 2.0, 8.0
DISC_BELOW_MM = 0.8  # of the disc below the free roller
BORE_PLAY_MM = 0.5  # on the diameter
RAMP_DEG, TAB_DEG, MIN_TAB_DEG = 5.0, 30.0, 6.0
PART_DEG = 3.0  # of the tab's outline
MA_PER_A = 1000.0
FREE_DEG = 30.0  # that tab and switch keep beyond the swing
TAB_ROOT_MM = 5.0  # by which the tab reaches into the disc
PIN_GRIP_MM = 10.0  # of the rod beyond the plate
MIN_EDGE_MM = 2.0  # of the disc beyond the pin's hole
# The arrow: a bar and a triangle across the disc's face, and a plus, (out, side).
BAR_MM = rectangle((-3.0, 40.2), (8.0, 41.2))
HEAD_MM = np.array([[-3.0, 37.7], [-3.0, 43.7], [-9.0, 40.7]])
PLUS_MM = rectangle((11.0, 40.2), (16.0, 41.2)), rectangle((13.0, 38.2), (14.0, 43.2))


def switch_place(half_width: float) -> tuple[float, float]:
    """Out and side of the middle of the switch's holes, beside a plate of half a width."""
    return (BRACKET_LOW_MM + BRACKET_HIGH_MM) / 2, half_width + BRACKET_MM / 2


def bracket_screws() -> tuple[float, float]:
    """Out of the bracket's two screws."""
    return BRACKET_LOW_MM + BRACKET_EDGE_MM, BRACKET_HIGH_MM - BRACKET_EDGE_MM


def tab_radius(half_width: float) -> float:
    """Radius of the tab, which presses the switch beside a plate of half a width."""
    return math.hypot(*switch_place(half_width)) - TRIP_MM + TAB_BEYOND_MM


@dataclass(frozen=True, kw_only=True)
class HomingLayout(Mounted):
    """Zero disc; bracket and switch, printed and purchased."""

    angles: HomeAngles  # of homing
    disc: Component  # the printed part that turns with the base
    pin: str  # name of the rod that fixes angle zero
    error_deg: float  # largest error of angle zero from the play of rod and key


def homing_layout(site: Site, before: FrameLayout) -> HomingLayout:
    """Disc, bracket and switch for a base and the plate behind it.

    Only a controller that homes has a switch and its bracket.

    SpecError when the swing leaves no room for the tab.
    """
    base, parts, plate = site.base, site.parts, before.of(BearingHead).plate
    angles = home_angles(site.layout, site.spec.prototype.motion)
    place = _SwitchPlace.beside(base, plate)
    length = base.hub.face - plate.back + PIN_GRIP_MM
    hint = "add a longer one"
    pin = choose_part(parts, "shafts", "the zero pin", hint, diameter_mm=PIN_MM, length_mm=length)
    # Either moves by half of its play in each of its two holes.
    error = (PIN_HOLE_MM - PIN_MM) / PIN_OUT_MM + (KEY_HOLE_MM - KEY_MM) / base.hub.key_radius
    homes = site.spec.prototype.motion.homes
    return HomingLayout(
        angles=angles,
        disc=_disc(base, place, angles),
        printed=(_bracket(base, plate, place),) if homes else (),
        purchased=(_switch(base, place, parts),) if homes else (),
        fasteners=_fasteners(base, plate, place, parts) if homes else (),
        listed={pin.name: 1, SWITCH: int(homes)},
        pin=pin.name,
        error_deg=math.degrees(error),
    )


@dataclass(frozen=True)
class _SwitchPlace:
    """Radius and azimuth of the switch's holes, place along the axis; radius of the tab."""

    radius: float
    azimuth: float
    low: float
    tab: float

    @classmethod
    def beside(cls, base: BaseLayout, plate: HeadPlate) -> "_SwitchPlace":
        (out, side), tab = switch_place(plate.half_width), tab_radius(plate.half_width)
        low = base.hub.face - (ZERO_DISC_MM + SWITCH_MM) / 2
        return cls(math.hypot(out, side), math.atan2(side, out), low, tab)

    @property
    def disc(self) -> float:
        """Radius of the disc, which the free roller clears."""
        return self.radius - FREE_MM - DISC_BELOW_MM

    def axes(self, base: BaseLayout) -> Floats:
        """Rows: away from the axis, around it, along it, (3, 3)."""
        (out, side), w = unit_circle(np.array(self.azimuth)), base.frame[0]
        radial = out * base.frame[1] + side * base.frame[2]
        return np.stack([radial, np.cross(w, radial), w])


def _disc(base: BaseLayout, place: _SwitchPlace, angles: HomeAngles) -> Component:
    hub, w = base.hub, base.frame[0]
    back = hub.face - ZERO_DISC_MM
    if place.disc < PIN_OUT_MM + PIN_HOLE_MM / 2 + MIN_EDGE_MM:
        raise SpecError("the zero disc has no room for its pin: make prototype.frame.web_mm larger")
    added: list[Primitive] = [
        base.cylinder(back, hub.face, place.disc),
        _prism(base, _tab(place, angles), back, ZERO_DISC_MM),
    ]
    holes = [(0.0, 0.0, 2 * hub.bore + BORE_PLAY_MM), (PIN_OUT_MM, 0.0, PIN_HOLE_MM)]
    holes += [(*hub.key.tolist(), KEY_HOLE_MM)]
    screw = SCREW_MM if hub.boss else hub.hole
    holes += [(out, side, screw) for out, side in hub.holes.tolist()]
    if base.rearmost < hub.face:
        raise SpecError(
            f"the carrier reaches {hub.face - base.rearmost:.1f} mm behind its hub, where the zero "
            "disc is: make prototype.base.hub_boss_mm larger"
        )
    low, high = back - THROUGH_MM, hub.face + THROUGH_MM
    removed: list[Primitive] = [
        base.cylinder(low, high, diameter / 2, out, side) for out, side, diameter in holes
    ]
    rim = rectangle((place.disc - MARK_MM, -MARK_MM / 2), (place.disc + MARK_MM, MARK_MM / 2))
    removed.append(_prism(base, rim, back - THROUGH_MM, ZERO_DISC_MM + 2 * THROUGH_MM))
    engraved = hub.face - MARK_DEPTH_MM
    removed += [
        _prism(base, shape, engraved, MARK_DEPTH_MM + THROUGH_MM)
        for shape in (BAR_MM, HEAD_MM, *PLUS_MM)
    ]
    what = "disc with mark, arrow and the tab of the switch, between hub and drive"
    return Component("zero_disc", what, tuple(added), tuple(removed), (-w, w), rotates=True)


def _prism(base: BaseLayout, polygon: Floats, back: float, height: float) -> Prism:
    """A convex polygon (n, 2) of (out, side) across the axis."""
    corners = np.array([base.point(back, out, side) for out, side in polygon.tolist()])
    return Prism(corners, height * base.frame[0])


def _tab(place: _SwitchPlace, angles: HomeAngles) -> Floats:
    """The tab's outline (n, 2) at angle zero: a ramp, and the arc that keeps the switch pressed.

    Its arc begins where the switch is when the base is at the switch's angle.
    """
    room = 360.0 - (angles.travel + FREE_DEG)
    if room < MIN_TAB_DEG:
        raise SpecError(
            f"a travel of {angles.travel:.0f} degrees leaves no room for the tab of the switch: "
            "make prototype.max_swing_deg smaller"
        )
    start, arc = place.azimuth - math.radians(angles.switch), math.radians(min(TAB_DEG, room))
    along = np.linspace(start, start + arc, 1 + math.ceil(math.degrees(arc) / PART_DEG))
    root = place.disc - TAB_ROOT_MM
    foot = place.disc * unit_circle(np.array([start - math.radians(RAMP_DEG)]))
    ends = root * unit_circle(np.array([start + arc, start - math.radians(RAMP_DEG)]))
    return np.vstack([foot, place.tab * unit_circle(along), ends])


def _bracket(base: BaseLayout, plate: HeadPlate, place: _SwitchPlace) -> Component:
    """A block on the plate's side, as high as the disc, that the switch lies on."""
    near, far, side = plate.half_width, plate.half_width + BRACKET_MM, base.frame[2]
    high = place.low, BRACKET_HIGH_MM, far
    body = box((plate.back, BRACKET_LOW_MM, near), high, base.frame)
    removed: list[Primitive] = []
    for out in bracket_screws():
        middle = plate.back + (plate.front - plate.back) / 2
        inner = base.point(middle, out, near - THROUGH_MM)
        outer = base.point(middle, out, far + THROUGH_MM)
        removed.append(cylinder_between(inner, outer, SCREW_MM / 2))
    axes = place.axes(base)
    for around in HOLES_MM:
        top = np.array([place.radius, around, place.low + THROUGH_MM]) @ axes
        depth = PILOT_DEPTH_MM + THROUGH_MM
        removed.append(Cylinder(top, -base.frame[0], PILOT_MM / 2, depth))
    downs = (-side, side, -base.frame[0], base.frame[1], -base.frame[1])
    return Component("home_bracket", "bracket of the switch", (body,), tuple(removed), downs)


def _fasteners(
    base: BaseLayout, plate: HeadPlate, place: _SwitchPlace, parts: Parts
) -> tuple[Fastener, ...]:
    """Screws of the bracket in the head's side, and of the switch in the bracket."""
    bracket = choose_screw(parts, 3.0, BRACKET_MM + ENGAGEMENT_MM)
    switch = choose_screw(parts, 2.0, SWITCH_MM + PILOT_DEPTH_MM / 2)
    middle, far = plate.back + (plate.front - plate.back) / 2, plate.half_width + BRACKET_MM
    axes, through = place.axes(base), ("home_bracket", "bearing_head")
    on_head = [
        Fastener(bracket, base.point(middle, out, far), -base.frame[2], through)
        for out in bracket_screws()
    ]
    top = place.low + SWITCH_MM
    bodies = ("home_switch", "home_bracket")
    on_bracket = [
        Fastener(switch, np.array([place.radius, around, top]) @ axes, -base.frame[0], bodies)
        for around in HOLES_MM
    ]
    return (*on_head, *on_bracket)


def _switch(base: BaseLayout, place: _SwitchPlace, parts: Parts) -> Component:
    """Body, lever and roller, pressed."""
    axes, r, z = place.axes(base), place.radius, place.low

    def at(away: float, around: float, along: float) -> Floats:
        return np.asarray(np.array([r - away, around, z + along]))

    roller = at(PRESSED_MM - ROLLER_MM / 2, 0.0, (SWITCH_MM - ROLLER_LENGTH_MM) / 2) @ axes
    added = (
        box(at(BODY_IN_MM, -BODY_HALF_MM, 0.0), at(-BODY_OUT_MM, BODY_HALF_MM, SWITCH_MM), axes),
        box(
            at(LEVER_FROM_MM, -LEVER_HALF_MM, (SWITCH_MM - ROLLER_LENGTH_MM) / 2),
            at(LEVER_TO_MM, LEVER_HALF_MM, (SWITCH_MM + ROLLER_LENGTH_MM) / 2),
            axes,
        ),
        Cylinder(roller, axes[2], ROLLER_MM / 2, ROLLER_LENGTH_MM),
    )
    depth = SWITCH_MM + 2 * THROUGH_MM
    starts = (at(0.0, around, -THROUGH_MM) @ axes for around in HOLES_MM)
    holes = tuple(Cylinder(start, axes[2], SWITCH_HOLE_MM / 2, depth) for start in starts)
    return Component("home_switch", parts[SWITCH].what, added, holes, part=SWITCH)


@planned("Switch and zero pin", "home_*", "zero_disc", loose=("shafts",), near=("zero_disc",))
def homing_step(machine: AssembledMachine) -> Values:
    """Switch, bracket and the zero pin."""
    home = machine.record.home
    return {
        "homes": machine.has("home_switch"),
        "pin": machine.ref(home.pin),
        "brake": machine.has("brake"),
        "motor": machine.has("motor"),
        "no_motor": not machine.has("motor"),
        "pin_mm": PIN_MM,
        "switch_deg": abs(home.switch_deg),
    }


@planned("Angle zero")
def zero_step(machine: AssembledMachine) -> Values:
    """Settings, homing and the trim."""
    firmware, off = machine.record.controller.firmware, machine.record.power_off
    homes, klipper = firmware != "grbl", firmware == "klipper"
    rated = next((row.current_ma for row in machine.wiring if row.signal == "motor"), None)
    return {
        "current": machine.record.drive.hold_current_a,
        "of_motor": f", {rated / MA_PER_A:.1f} A," if rated else "",
        "homes": homes,
        "grbl": not klipper,
        "klipper": klipper,
        "grblhal": firmware == "grblhal",
        "by_hand": not homes,
        "unlock": when(firmware == "grblhal", "Unlock the controller by $X. "),
        "falls": not off.brake and off.fall_energy_j,
        "brake": off.brake and machine.ref(off.brake),
        "off": off,
        "pinned": off.pin_force_n,
        "home": machine.record.home,
    }


HOMING = Part((homing_step,), homing_layout)
ZERO = Part((zero_step,))
