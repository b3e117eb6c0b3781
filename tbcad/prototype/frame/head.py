"""The head of the frame: bearings on the axis beyond the hub, and the plate of the motor.

It is a plate across the axis with a tube for the bearings, held by a flange on the uprights; two
webs between plate and flange leave space for tube and motor.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from tbcad.core.geometry.primitives import (
    Component,
    Primitive,
    box,
    cylinder_between,
    rectangle,
    slot,
)
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import FrameSpec
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned
from tbcad.prototype.base.fasteners import m3_insert
from tbcad.prototype.base.hub import PIN_OUT_MM
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.driven import (
    COUPLING_MM,
    STAGE_HEIGHT_MM,
    ShaftParts,
    motor_fasteners,
    motor_screw_places,
    purchased_components,
    wheel_radius,
)
from tbcad.prototype.frame.shared import (
    CLEARANCE_HOLE_MM,
    GAP_MM,
    HALF_FLANGE_MM,
    OVERLAP_MM,
    PLATE_MM,
    THROUGH_MM,
    BearingHead,
    HeadPlate,
    drilled_holes,
    level_prism,
    on_uprights,
    webs,
)
from tbcad.prototype.homing import (
    MARK_DEPTH_MM,
    MARK_END_MM,
    MARK_MM,
    MIN_PLATE_MM,
    PIN_HOLE_MM,
    bracket_screws,
    tab_radius,
)
from tbcad.prototype.part import FrameLayout, Part, Site
from tbcad.prototype.purchased.parts import choose_part
from tbcad.types import Floats

# Behind the head of a rotary stage's screw (M6, ISO 4762): room for it, and the length of its key.
M6_HEAD_MM, HEAD_PLAY_MM, KEY_ROOM_MM = 10.0, 0.5, 95.0
RELIEF_MM = 0.3  # round a bearing, where it passes
SHOULDER_MM = 3.0  # width of the shoulder behind a bearing
TUBE_WALL_MM = 6.0  # of the tube round the bearings
MIN_TUBE_MM = 45.0  # length
COLLAR_GAP_MM = 2.0  # between tube and collar
BELOW_AXIS_MM = 20.0  # smallest reach of the plate with a belt below the axis
EDGE_MM = 3.0  # of the plate round the motor
WEB_MM = 24.0  # from the middle to the webs: a NEMA 17 motor goes between
WEB_EDGE_MM = 1.0  # of the plate beyond the webs
REACH_MM = 45.0  # of the webs up the plate, from the axis
ABOVE_MM, BELOW_MM = 55.0, 30.0  # of the flange beyond the axis and the plate's lower edge
SCREW_EDGE_MM = 10.0  # from the flange's ends to its screws
PILOT_PLAY_MM = 0.2
WINDOW_PLAY_MM, WINDOW_BEYOND_MM = 1.0, 20.0  # round a motor on the axis, and behind it


def bearing_head(site: Site, _: FrameLayout) -> BearingHead:
    """The head for a drive behind the base's hub.

    SpecError when there is no bearing or shaft for the hub's bore, or the motor meets it.
    """
    spec, base, axes, parts = site.spec.prototype.frame, site.base, site.axes, site.parts
    plate = _behind_disc(_head_plate(site), base, axes)
    shaft_parts = _shaft_parts(site, plate) if site.drive.belt else None
    edge = axes @ base.point(plate.back, plate.low)
    face = float(edge[0] + OVERLAP_MM - spec.flange_mm)
    low, top = float(edge[2]) - BELOW_MM, float(edge[2]) + ABOVE_MM - plate.low
    corner = plate.front, plate.high, plate.half_width
    body = box((plate.back, plate.low, -plate.half_width), corner, base.frame)
    added = [body, *_flange(site, plate, (face, low, top))]
    removed = _motor_holes(site, plate)
    places = bracket_screws() if site.spec.prototype.motion.homes else ()
    removed += _zero_holes(base, plate, places)
    sides = (-spec.uprights_mm / 2, spec.uprights_mm / 2)
    heights = (low + SCREW_EDGE_MM, top - SCREW_EDGE_MM)
    screws = [np.array([face, y, z]) @ axes for z in heights for y in sides]
    insert, beside = m3_insert(base.spec, parts), plate.front - PLATE_MM / 2
    removed += drilled_holes(screws, spec.flange_mm * axes[0], CLEARANCE_HOLE_MM[5.0])
    if shaft_parts:
        rear, radius = shaft_parts.rear, shaft_parts.tube
        added.append(base.cylinder(plate.front - OVERLAP_MM, rear, radius))
        removed += _seats(spec, base, plate, shaft_parts)
    w = base.frame[0]
    component = Component(
        "bearing_head",
        "head with bearings and motor",
        tuple(added),
        tuple(removed),
        (w, -w),  # bores of bearings upright, which are round then
    )
    return BearingHead(
        printed=(component,),
        plate=plate,
        purchased=purchased_components(site, plate, shaft_parts),
        fasteners=(
            *on_uprights(component.name, screws, -axes[0], spec.flange_mm, parts),
            *motor_fasteners(site, plate),
            *(
                Fastener(
                    insert,
                    base.point(beside, out, plate.half_width),
                    -base.frame[2],
                    (component.name,),
                )
                for out in places
            ),
        ),
        listed=shaft_parts.listed if shaft_parts else {},
        rear=shaft_parts.rear if shaft_parts else plate.back,
        shaft=shaft_parts.shaft if shaft_parts else None,
        face=face,
        top=top,
    )


def _behind_disc(plate: HeadPlate, base: BaseLayout, axes: Floats) -> HeadPlate:
    """A plate that reaches so far below the axis that the zero disc clears the flange there."""
    along, out = axes[0] @ base.frame[0], axes[0] @ base.frame[1]
    behind = (base.hub.mount - plate.back) * along - OVERLAP_MM - GAP_MM
    low = behind / out - tab_radius(plate.half_width) if out > 0 else plate.low
    return replace(plate, low=min(plate.low, float(low)))


def _head_plate(site: Site) -> HeadPlate:
    spec, base, drive = site.spec.prototype.frame, site.base, site.drive
    reach, face, half_webs = drive.centre_mm, base.hub.mount, WEB_MM + spec.web_mm + WEB_EDGE_MM
    if drive.wheel and drive.belt:
        half_motor = drive.motor["frame_mm"] / 2 + spec.belt_travel_mm / 2
        if reach < half_motor + 2 * TUBE_WALL_MM + base.spec.shaft_mm:
            raise SpecError(
                f"the motor of drive {drive.name} would meet the bearings at {reach:.1f} mm: use a "
                f"longer belt in drives.csv or make prototype.frame.belt_travel_mm less"
            )
        front = face - drive.wheel["width_mm"] - GAP_MM
        # The flange begins where the plate ends, and there the wheel must have passed it.
        low = max(BELOW_AXIS_MM, wheel_radius(drive.wheel) + GAP_MM)
        return HeadPlate(front, -low, reach + half_motor + EDGE_MM, half_webs)
    if drive.coupling:
        half = drive.motor["frame_mm"] / 2 + EDGE_MM
        width = max(half, half_webs)
        return HeadPlate(face - COUPLING_MM, -half, max(half, MIN_PLATE_MM), width)
    half = max(drive.motor["top_mm"] / 2 + EDGE_MM, half_webs)
    return HeadPlate(face - STAGE_HEIGHT_MM, -half, max(half, MIN_PLATE_MM), half)


def _shaft_parts(site: Site, plate: HeadPlate) -> ShaftParts:
    base, parts, wheel = site.base, site.parts, site.drive.wheel
    bore, key = base.spec.shaft_mm, "prototype.base.shaft_mm"
    if wheel and wheel["bore_mm"] != bore:
        raise SpecError(
            f"{key} is {bore:g}, but wheel {wheel.name} has a bore of {wheel['bore_mm']:g} mm: set "
            "it to that"
        )
    hint = "set it to 8, 10 or 12, or add one to the list"
    bearing = choose_part(parts, "bearings", key, hint, "width_mm", bore_mm=bore)
    collar = choose_part(parts, "collars", key, hint, "width_mm", bore_mm=bore)
    in_front = base.hub.socket - plate.front
    spacer = choose_part(parts, "spacers", key, hint, "outer_mm", bore_mm=bore, width_mm=GAP_MM)
    length = in_front + MIN_TUBE_MM + collar["width_mm"] + COLLAR_GAP_MM
    shaft = choose_part(parts, "shafts", key, hint, diameter_mm=bore, length_mm=length)
    rear = base.hub.socket - shaft["length_mm"] + collar["width_mm"] + COLLAR_GAP_MM
    return ShaftParts(bearing, shaft, collar, spacer, rear, bearing["outer_mm"] / 2 + TUBE_WALL_MM)


def _flange(site: Site, plate: HeadPlate, at: tuple[float, float, float]) -> list[Primitive]:
    """Flange with its face at a level coordinate, between two heights, and its webs."""
    spec, base, axes, (face, low, top) = site.spec.prototype.frame, site.base, site.axes, at
    half = spec.uprights_mm / 2 + HALF_FLANGE_MM
    front, inside = face + spec.flange_mm, face + spec.flange_mm - OVERLAP_MM
    flange = level_prism(rectangle((face, low), (front, top)), -half, half, axes)
    # The webs' one edge lies within the plate, its line prolonged into the flange.
    start = axes @ base.point(plate.back + OVERLAP_MM, 0.0)
    rise = axes @ base.frame[1]
    foot = start + (inside - start[0]) / rise[0] * rise
    end = start + min(REACH_MM, plate.high) * rise
    corners = np.array([foot[[0, 2]], end[[0, 2]], [inside, top]])
    return [flange, *webs(corners, WEB_MM, spec.web_mm, axes)]


def _zero_holes(base: BaseLayout, plate: HeadPlate, places: Iterable[float]) -> list[Primitive]:
    """Hole of the zero pin and mark beside it; inserts for the bracket of the switch, out."""
    spec, through = base.spec, (PLATE_MM + 2 * THROUGH_MM) * base.frame[0]
    pin = base.point(plate.back - THROUGH_MM, PIN_OUT_MM)
    mark = plate.front - MARK_DEPTH_MM, PIN_OUT_MM, -MARK_MM / 2
    end = plate.front + THROUGH_MM, MARK_END_MM, MARK_MM / 2
    holes: list[Primitive] = [cylinder_between(pin, pin + through, PIN_HOLE_MM / 2)]
    holes.append(box(mark, end, base.frame))
    middle, deep = plate.front - PLATE_MM / 2, plate.half_width - spec.insert_depth_mm
    for out in places:
        inner = base.point(middle, out, deep)
        outer = base.point(middle, out, plate.half_width + THROUGH_MM)
        holes.append(cylinder_between(inner, outer, spec.insert_hole_mm / 2))
    return holes


def _seats(
    spec: FrameSpec, base: BaseLayout, plate: HeadPlate, shaft_parts: ShaftParts
) -> list[Primitive]:
    """Seats to either end, and between them a bore that leaves a shoulder."""
    width, outer = shaft_parts.bearing["width_mm"], shaft_parts.bearing["outer_mm"]
    rear, seat = shaft_parts.rear, (outer + spec.bearing_fit_mm) / 2
    beyond = rear - 2 * shaft_parts.tube
    return [
        base.cylinder(plate.front + THROUGH_MM, plate.front - width, seat),
        base.cylinder(plate.front, beyond, outer / 2 - SHOULDER_MM),
        base.cylinder(rear + width, rear - THROUGH_MM, seat),
        # The flange may reach beyond the tube: the bearing goes through it without being pressed.
        base.cylinder(rear, beyond, outer / 2 + RELIEF_MM),
    ]


def _motor_holes(site: Site, plate: HeadPlate) -> list[Primitive]:
    """Pilot and screws: slots along the plate for a belt, a window for a motor on the axis."""
    spec, base, drive = site.spec.prototype.frame, site.base, site.drive
    motor, depth = drive.motor, (PLATE_MM + 2 * THROUGH_MM) * base.frame[0]
    start = plate.back - THROUGH_MM
    places = [base.point(start, out, side) for out, side in motor_screw_places(drive)]
    if motor.kind == "stages":
        # Screws go in from behind, where flange and webs are.
        behind = (KEY_ROOM_MM + THROUGH_MM) * base.frame[0]
        through = [cylinder_between(place, place + depth, motor["hole_mm"] / 2) for place in places]
        access = M6_HEAD_MM / 2 + HEAD_PLAY_MM
        to_heads = [at + THROUGH_MM * base.frame[0] for at in places]
        return [*through, *(cylinder_between(at - behind, at, access) for at in to_heads)]
    travel = spec.belt_travel_mm if drive.belt else 0.0
    pilot, screw = motor["pilot_mm"] / 2 + PILOT_PLAY_MM, CLEARANCE_HOLE_MM[motor["thread_mm"]] / 2
    middle = base.point(start, drive.centre_mm)
    holes = [slot(middle, base.frame[1], travel, pilot, depth)]
    holes += [slot(place, base.frame[1], travel, screw, depth) for place in places]
    if not drive.belt:
        size = motor["frame_mm"] / 2 + WINDOW_PLAY_MM
        low = plate.back - drive.motor_length_mm - WINDOW_BEYOND_MM, -size, -size
        holes.append(box(low, (plate.back, size, size), base.frame))
    return holes


@planned("Bearing head on the uprights", "bearing_*")
def head_step(machine: AssembledMachine) -> Values:
    """Bearings and head."""
    return {"bracket": machine.has("home_bracket"), "bearings": machine.has("bearing_front")}


HEAD = Part((head_step,), bearing_head)
