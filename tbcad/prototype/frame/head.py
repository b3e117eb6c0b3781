"""The head of the frame: bearings on the axis beyond the hub, and the plate of the motor.

It is a plate across the axis with a tube for the bearings, held by a flange on the uprights; two
webs between plate and flange leave the middle to tube and motor.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import Component, Primitive, box, cylinder_between, slot
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.frame.brackets import (
    HOLES_MM,
    SUNK_MM,
    THROUGH_MM,
    drilled,
    fitting,
    slab,
    webs,
)
from tbcad.prototype.frame.purchased import (
    COUPLING_MM,
    PLATE_MM,
    Bearings,
    Plan,
    along,
    bought,
    local,
    middles,
    wheel_radius,
)
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import FrameSpec
from tbcad.types import Floats

GAP_MM = 3.0  # between what turns and the plate
SHOULDER_MM = 3.0
WALL_MM = 6.0  # of the tube round the bearings
LEAST_TUBE_MM = 45.0
STAGE_MM = 40.0  # height of a stage of the 60 mm class; assumed
EDGE_MM = 3.0
WEB_MM = 24.0  # from the middle to the webs: a NEMA 17 motor goes between
REACH_MM = 45.0  # of the webs up the plate, from the axis
ABOVE_MM, UNDER_MM = 55.0, 30.0  # of the flange beyond the axis and the plate's lower edge


@dataclass(frozen=True)
class Head:
    """The head; lengths along w in mm, from the origin.

    Attributes:
        item: the printed part.
        bought: what is in it: bearings, shaft, collar, wheels, motor.
        front: of the plate's face toward the hub.
        rear: of the tube's end.
        bearings: middles of the bearings, none without a shaft.
        shaft: name of the shaft's part, if any.
        motor: distance of the motor's axis from w, mm.
        face: level coordinate of the flange's face on the uprights.
        top: height of the flange's upper end, mm.
        screws: heights of its screws, mm.
    """

    item: Component
    bought: tuple[Component, ...]
    front: float
    rear: float
    bearings: tuple[float, ...]
    shaft: PurchasedPart | None
    motor: float
    face: float
    top: float
    screws: tuple[float, float]


def head(keys: FrameSpec, base: BaseLayout, drive: Drive, axes: Floats, parts: Parts) -> Head:
    """The head for a drive.

    Args:
        keys: section of the frame.
        base: whose hub it stands behind.
        drive: belt, direct or stage.
        axes: of the frame, as rows, (3, 3).
        parts: purchased parts.

    Raises:
        SpecError: when there is no bearing or shaft for the hub's bore, or the motor meets it.
    """
    plan = _plan(keys, base, drive)
    held = _bearings(base, plan, parts) if drive.belt else None
    corner = axes @ local(base, plan.back, plan.low)
    face = float(corner[0] + SUNK_MM - keys.flange_mm)
    low, top = float(corner[2]) - UNDER_MM, float(corner[2]) + ABOVE_MM - plan.low
    screws = (low + 10.0, top - 10.0)
    added = [*_plate(base, plan), *_flange(keys, base, plan, axes, (face, low, top))]
    removed = [*_motor_holes(keys, base, drive, plan, parts), *_screws(keys, axes, face, screws)]
    if held:
        added.append(along(base, plan.front - SUNK_MM, held.rear, held.tube))
        removed += _seats(keys, base, plan, held)
    w = base.frame[0]
    item = Component(
        "bearing_head",
        "head with bearings and motor",
        tuple(added),
        tuple(removed),
        tuple((float(d[0]), float(d[1]), float(d[2])) for d in (w, -w, axes[0], -axes[0], axes[1])),
    )
    return Head(
        item=item,
        bought=bought(base, drive, plan, held),
        front=plan.front,
        rear=held.rear if held else plan.back,
        bearings=middles(plan, held) if held else (),
        shaft=held.shaft if held else None,
        motor=drive.centre_mm,
        face=face,
        top=top,
        screws=screws,
    )


def _plan(keys: FrameSpec, base: BaseLayout, drive: Drive) -> Plan:
    reach, face = drive.centre_mm, base.hub.face
    if drive.wheel and drive.belt:
        travel = keys.belt_travel_mm / 2
        least = drive.motor["frame_mm"] / 2 + travel + 2 * WALL_MM + base.spec.shaft_mm
        if reach < least:
            raise SpecError(
                f"the motor of drive {drive.name} would meet the bearings at {reach:.1f} mm: use a "
                f"longer belt in drives.csv or make prototype.frame.belt_travel_mm less"
            )
        high = reach + drive.motor["frame_mm"] / 2 + travel + EDGE_MM
        front = face - drive.wheel["width_mm"] - GAP_MM
        # The flange begins where the plate ends, and there the wheel must have passed it.
        low = max(WALL_MM + 14.0, wheel_radius(drive.wheel) + GAP_MM)
        return Plan(front, -low, high, WEB_MM + keys.web_mm + 1)
    if drive.coupling:
        half = drive.motor["frame_mm"] / 2 + EDGE_MM
        wide = max(half, WEB_MM + keys.web_mm + 1)
        return Plan(face - COUPLING_MM, -half, max(half, REACH_MM), wide)
    half = max(drive.motor["top_mm"] / 2 + EDGE_MM, WEB_MM + keys.web_mm + 1)
    return Plan(face - STAGE_MM, -half, max(half, REACH_MM), half)


def _bearings(base: BaseLayout, plan: Plan, parts: Parts) -> Bearings:
    bore, key = base.spec.shaft_mm, "prototype.base.shaft_mm"
    hint = "set it to 8, 10 or 12, or add one to the list"
    bearing = fitting(parts, "bearings", key, hint, "width_mm", bore_mm=bore)
    collar = fitting(parts, "collars", key, hint, "width_mm", bore_mm=bore)
    over = base.hub.front - plan.front
    need = over + LEAST_TUBE_MM + collar["width_mm"] + 2
    shaft = fitting(parts, "shafts", key, hint, diameter_mm=bore, length_mm=need)
    rear = base.hub.front - shaft["length_mm"] + collar["width_mm"] + 2
    return Bearings(bearing, shaft, collar, rear, bearing["outer_mm"] / 2 + WALL_MM)


def _plate(base: BaseLayout, plan: Plan) -> list[Primitive]:
    low = np.array([plan.back, plan.low, -plan.half])
    return [box(low, np.array([plan.front, plan.high, plan.half]), base.frame)]


def _flange(
    keys: FrameSpec, base: BaseLayout, plan: Plan, axes: Floats, at: tuple[float, float, float]
) -> list[Primitive]:
    face, low, top = at
    half = keys.uprights_mm / 2 + 10
    front, inside = face + keys.flange_mm, face + keys.flange_mm - SUNK_MM
    plate = slab(
        np.array([[face, low], [front, low], [front, top], [face, top]]), -half, half, axes
    )
    # The webs' one edge lies within the plate, its line prolonged into the flange.
    start = axes @ local(base, plan.back + SUNK_MM, 0.0)
    rise = axes @ base.frame[1]
    foot = start + (inside - start[0]) / rise[0] * rise
    end = start + min(REACH_MM, plan.high) * rise
    corners = np.array([foot[[0, 2]], end[[0, 2]], [inside, top]])
    return [plate, *webs(corners, WEB_MM, keys.web_mm, axes)]


def _screws(
    keys: FrameSpec, axes: Floats, face: float, heights: tuple[float, float]
) -> list[Primitive]:
    places = [
        np.array([face, side * keys.uprights_mm / 2, z]) @ axes for z in heights for side in (-1, 1)
    ]
    return drilled(places, keys.flange_mm * axes[0], HOLES_MM[5.0])


def _seats(keys: FrameSpec, base: BaseLayout, plan: Plan, held: Bearings) -> list[Primitive]:
    """Seats to either end, and between them a bore that leaves a shoulder."""
    width, outer = held.bearing["width_mm"], held.bearing["outer_mm"]
    seat, beyond = (outer + keys.bearing_fit_mm) / 2, held.rear - 2 * held.tube
    return [
        along(base, plan.front + THROUGH_MM, plan.front - width, seat),
        along(base, plan.front, beyond, outer / 2 - SHOULDER_MM),
        along(base, held.rear + width, beyond, seat),
    ]


def _motor_holes(
    keys: FrameSpec, base: BaseLayout, drive: Drive, plan: Plan, parts: Parts
) -> list[Primitive]:
    """Pilot and screws: slots along the plate for a belt, a window for a motor on the axis."""
    motor, depth = drive.motor, (PLATE_MM + 2 * THROUGH_MM) * base.frame[0]
    start = plan.back - THROUGH_MM
    if motor.kind == "stages":
        return _circle(base, start, depth, motor["hole_circle_mm"], motor["hole_mm"])
    travel = keys.belt_travel_mm if drive.belt else 0.0
    middle, half = drive.centre_mm, motor["hole_square_mm"] / 2
    pilot = local(base, start, middle)
    found = list(slot(pilot, base.frame[1], travel, motor["pilot_mm"] / 2 + 0.2, depth))
    for out in (middle - half, middle + half):
        for side in (-half, half):
            place, hole = local(base, start, out, side), HOLES_MM[motor["thread_mm"]] / 2
            found += slot(place, base.frame[1], travel, hole, depth)
    if not drive.belt:
        size = motor["frame_mm"] / 2 + 1
        low = np.array([plan.back - motor["length_mm"] - 20, -size, -size])
        found.append(box(low, np.array([plan.back, size, size]), base.frame))
    return found


def _circle(
    base: BaseLayout, start: float, depth: Floats, circle: float, hole: float
) -> list[Primitive]:
    turn = np.pi / 4 + np.arange(4) * np.pi / 2
    places = circle / 2 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    at = [local(base, start, float(out), float(side)) for out, side in places]
    return [cylinder_between(place, place + depth, hole / 2) for place in at]
